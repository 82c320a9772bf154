"""Where the pictures of a page stand: every cell of every view of one size, worked out and not searched for."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibrate.report.workspace.sections import Grid

WIDTH_IN = 9.9  # of the whole page
CELL_IN = 0.13  # at most
LEFT_IN, RIGHT_IN = 0.95, 0.15  # names and numbers of the first axis; half a number
BETWEEN_IN, VIEWS_IN = 0.25, 0.85  # pictures of one view, views
TITLE_IN, NAME_IN = 0.3, 0.55  # above and below a picture
BAR_IN, BAR_HIGH_IN, BAR_TEXT_IN = 0.75, 0.16, 0.5  # the scale at the bottom, its height, what stands below it


@dataclass(frozen=True)
class Sheet:
    """Rows of pictures, in each row every layer of the first view, then of the next."""

    grids: tuple[Grid, ...]
    layers: int  # in a row
    rows: int

    @property
    def cell_in(self) -> float:
        """Side of a cell."""
        cells = self.layers * sum(grid.shape[0] for grid in self.grids)
        return min(CELL_IN, (WIDTH_IN - self._gaps_in) / cells)

    @property
    def _gaps_in(self) -> float:
        views = len(self.grids)
        return LEFT_IN + RIGHT_IN + views * (self.layers - 1) * BETWEEN_IN + (views - 1) * VIEWS_IN

    @property
    def _row_in(self) -> float:
        return self.cell_in * max(grid.shape[1] for grid in self.grids) + TITLE_IN + NAME_IN

    @property
    def size_in(self) -> tuple[float, float]:
        """Width and height of the figure."""
        cells = self.layers * sum(grid.shape[0] for grid in self.grids)
        return self._gaps_in + self.cell_in * cells, self.rows * self._row_in + BAR_IN

    def axes(self, figure: Figure, row: int) -> list[list[Axes]]:
        """Of each view, one a layer."""
        bottom = BAR_IN + (self.rows - 1 - row) * self._row_in + NAME_IN
        out: list[list[Axes]] = []
        x = LEFT_IN
        for grid in self.grids:
            wide, high = (self.cell_in * n for n in grid.shape)
            places = [x + k * (wide + BETWEEN_IN) for k in range(self.layers)]
            out.append([self._add(figure, (place, bottom, wide, high)) for place in places])
            x = places[-1] + wide + VIEWS_IN
        return out

    def bar(self, figure: Figure) -> Axes:
        """For the scale."""
        return self._add(figure, (LEFT_IN, BAR_TEXT_IN, self.size_in[0] - LEFT_IN - 3.0 * RIGHT_IN, BAR_HIGH_IN))

    def _add(self, figure: Figure, box_in: Sequence[float]) -> Axes:
        wide, high = self.size_in
        left, bottom, width, height = box_in
        return figure.add_axes((left / wide, bottom / high, width / wide, height / high))
