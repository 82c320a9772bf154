"""The error over the workspace before and after, predicted and where poses were measured, all on one scale.

Where the pictures of a page stand: every cell of every view of one size, worked out and not searched for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibrate.report.elements.html import Html
from calibrate.report.elements.svg import drawn
from calibrate.report.workspace.cells import (
    SIDE,
    VIEWS,
    Grid,
    Steps,
    dress,
    grid_of,
    paint_cells,
    paint_measured,
    paint_poses,
    paint_unsupported,
    scale_bar,
    steps_for,
)
from calibrate.report.workspace.workspace_errors import Room

Floats = NDArray[np.float64]

WIDTH_IN = 9.9  # of the whole page
MAPS_IN = 4.8  # of the two maps of the first screen: a panel
CELL_IN = 0.13  # at most
LEFT_IN, RIGHT_IN = 0.95, 0.15  # names and numbers of the first axis; half a number
BETWEEN_IN, VIEWS_IN = 0.25, 0.85  # pictures of one view, views
TITLE_IN, NAME_IN = 0.3, 0.55  # above and below a picture
BAR_IN, BAR_HIGH_IN, BAR_TEXT_IN = 0.75, 0.16, 0.5  # the scale at the bottom, its height, what stands below it


@dataclass(frozen=True)
class MeasuredErrors:
    """Errors at poses of the session."""

    points_m: Floats  # (row, 3) of the target in the base
    drawn_m: Floats  # (row,) distance of measured from expected, nominal arm, frames where they fit best
    found_m: Floats  # (row,) the same for the identified arm, predicted from all other rows


@dataclass(frozen=True)
class Layer:
    """One picture: values of cells by view, or of points."""

    title: str
    cells_m: tuple[Floats, ...]  # one a view; empty for points
    points_m: Floats | None = None
    values_m: Floats | None = None


def before_and_after(room: Room, measured: MeasuredErrors | None) -> Html:
    """Both views of both states; in a second row what was measured."""
    grids = tuple(grid_of(view, room.reach_m) for view in VIEWS)
    rows = {"predicted": _predicted(room, grids)}
    if measured is not None:
        titles = ("nominal", "calibrated")
        values = (measured.drawn_m, measured.found_m)
        rows["measured"] = [Layer(t, (), measured.points_m, v) for t, v in zip(titles, values, strict=True)]
    says = "predicted error of the target over the workspace, nominal and calibrated, from the side and from above"
    return pictures("workspace", says, room, grids, rows, "error of the target")


def _predicted(room: Room, grids: tuple[Grid, ...]) -> list[Layer]:
    states = (("nominal", room.drawn_m), ("calibrated", room.found_m))
    return [
        Layer(title, tuple(grid.rms(room.points_m, values, room.supported) for grid in grids))
        for title, values in states
    ]


def tool_maps(room: Room) -> Html:
    """Nominal and calibrated from the side, on one scale: beside the number of the first screen."""
    grid = grid_of(SIDE, room.reach_m)
    says = "error of the tool over the workspace from the side, nominal and calibrated, on one scale"
    return pictures("tool", says, room, (grid,), {"": _predicted(room, (grid,))}, "error of the tool, rms", MAPS_IN)


def pictures(
    name: str,
    says: str,
    room: Room,
    grids: tuple[Grid, ...],
    rows: Mapping[str, list[Layer]],
    scale_says: str,
    width_in: float = WIDTH_IN,
) -> Html:
    """Rows of layers by what they are, each layer in every view, with one scale for all."""
    layers = [layer for row in rows.values() for layer in row]
    values = [np.concatenate([c.ravel() for c in layer.cells_m]) for layer in layers if layer.cells_m]
    values += [layer.values_m for layer in layers if layer.values_m is not None]
    steps = steps_for(np.concatenate(values))
    sheet = Sheet(grids, len(layers) // len(rows), len(rows), width_in)

    def paint(figure: Figure) -> None:
        figure.set_layout_engine("none")
        for number, (what, row) in enumerate(rows.items()):
            for view, places in enumerate(sheet.axes(figure, number)):
                for k, (axes, layer) in enumerate(zip(places, row, strict=True)):
                    _paint(axes, room, grids[view], layer, view, steps)
                    dress(axes, grids[view], layer.title, what if view == 0 else "", first=k == 0)
        key = scale_says
        if width_in >= WIDTH_IN:  # else the words stand in the caption alone
            key += "; hatched: not covered by the calibration poses; circles: poses of the session; +: base"
        scale_bar(figure, sheet.bar(figure), steps, key)

    return drawn(name, says, *sheet.size_in, paint)


def _paint(axes: Axes, room: Room, grid: Grid, layer: Layer, view: int, steps: Steps) -> None:
    if layer.cells_m:
        paint_cells(axes, grid, layer.cells_m[view], steps)
        paint_unsupported(axes, grid, grid.reached(room.reach_m) & np.isnan(layer.cells_m[view]))
        paint_poses(axes, grid, room.session_m)
    elif layer.points_m is not None and layer.values_m is not None:
        paint_measured(axes, grid, layer.points_m, layer.values_m, steps)


@dataclass(frozen=True)
class Sheet:
    """Rows of pictures, in each row every layer of the first view, then of the next."""

    grids: tuple[Grid, ...]
    layers: int  # in a row
    rows: int
    width_in: float = WIDTH_IN

    @property
    def cell_in(self) -> float:
        """Side of a cell."""
        cells = self.layers * sum(grid.shape[0] for grid in self.grids)
        return min(CELL_IN, (self.width_in - self._gaps_in) / cells)

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
