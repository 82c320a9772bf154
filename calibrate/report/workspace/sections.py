"""Two views of the workspace, cut into cells: from the side (distance from axis z of the base, height), from above."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

ACROSS = 24  # cells over the width of the view from above


@dataclass(frozen=True)
class View:
    """How points become two coordinates."""

    name: str
    title: str
    across: str
    up: str

    def flat(self, points_m: Floats) -> Floats:
        """(point, 2) m."""
        if self.name == "side":
            return np.stack([np.hypot(points_m[:, 0], points_m[:, 1]), points_m[:, 2]], axis=1)
        return points_m[:, :2]


SIDE = View("side", "from the side", "radius (m)", "height z (m)")
ABOVE = View("above", "from above", "x (m)", "y (m)")
VIEWS = (SIDE, ABOVE)


@dataclass(frozen=True)
class Grid:
    """Square cells of one view, that hold everything the arm can reach."""

    view: View
    cell_m: float
    first: tuple[int, int]  # cell of the lower left corner, counted from the base
    shape: tuple[int, int]  # (across, up)

    @property
    def box_m(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top."""
        (i, j), (n, m), c = self.first, self.shape, self.cell_m
        return i * c, (i + n) * c, j * c, (j + m) * c

    def cells(self, points_m: Floats) -> NDArray[np.intp]:
        """(point,) number of the cell."""
        at = np.floor(self.view.flat(points_m) / self.cell_m).astype(np.intp) - np.array(self.first)
        at = np.clip(at, 0, np.array(self.shape) - 1)
        return at[:, 0] * self.shape[1] + at[:, 1]

    def rms(self, points_m: Floats, values: Floats, chosen: Bools) -> Floats:
        """(across, up) root mean square of the values (point,) of the chosen points; NaN where there is none."""
        at, n = self.cells(points_m[chosen]), self.shape[0] * self.shape[1]
        count = np.bincount(at, minlength=n)
        square = np.bincount(at, weights=values[chosen] ** 2, minlength=n)
        with np.errstate(invalid="ignore"):
            return np.sqrt(square / np.where(count == 0, np.nan, count)).reshape(self.shape)

    def reached(self, points_m: Floats) -> Bools:
        """(across, up) whether any point is in the cell."""
        n = self.shape[0] * self.shape[1]
        return (np.bincount(self.cells(points_m), minlength=n) > 0).reshape(self.shape)


def grid_of(view: View, reach_m: Floats) -> Grid:
    """Cells of one size in both views, round everything that can be reached (point, 3)."""
    cell_m = float(np.ptp(reach_m[:, :2], axis=0).max()) / ACROSS
    at = np.floor(view.flat(reach_m) / cell_m).astype(int)
    low, high = at.min(axis=0), at.max(axis=0)
    return Grid(view, cell_m, (int(low[0]), int(low[1])), (int(high[0] - low[0] + 1), int(high[1] - low[1] + 1)))
