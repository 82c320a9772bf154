"""Two views of the workspace cut into cells, from the side (distance from axis z of the base, height) and from above.

Cells are drawn as one path a colour, hatched where nothing is known, with poses as points. Lengths are steps in colours
that darken evenly, so that they also read in grey and to colour-blind eyes: cividis, Nunez, Anderton, Renslow, PLOS ONE
13(7), 2018.
"""

from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from calibrate.quantities import length
from calibrate.report.elements.tones import Tone

Floats = NDArray[np.float64]

COARSE = (1.0, 2.0, 5.0)  # of a decade
FINE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
AT_MOST = 12  # steps: with more of the fine ones the coarse ones are taken
LEAST = 0.05  # quantile of the values below which steps would only serve single points


@dataclass(frozen=True)
class Steps:
    """Bounds (step + 1,) in m and a colour for each step between two of them."""

    bounds_m: tuple[float, ...]
    colours: tuple[str, ...]
    open_below: bool = False  # whether smaller values count to the first step

    def of(self, values_m: Floats) -> NDArray[np.intp]:
        """Number of the step of each value; what is outside counts to the first or last. -1 where not finite."""
        step = np.clip(np.searchsorted(self.bounds_m, values_m, side="right") - 1, 0, len(self.colours) - 1)
        return np.where(np.isfinite(values_m), step, -1)


def steps_for(values_m: Floats) -> Steps:
    """Round steps over all finite values but the very smallest; those that a page can show: the largest."""
    finite = values_m[np.isfinite(values_m) & (values_m > 0.0)]
    low, high = (float(np.quantile(finite, LEAST)), float(np.max(finite))) if len(finite) else (1e-6, 1e-5)
    bounds = _between(low, high, FINE)
    if len(bounds) > AT_MOST + 1:
        bounds = _between(low, high, COARSE)[-AT_MOST - 1 :]
    ramp = mpl.colormaps["cividis"](np.linspace(1.0, 0.0, len(bounds) - 1))
    below = bool(np.any(finite < bounds[0]))
    return Steps(tuple(bounds), tuple(to_hex(colour) for colour in ramp), below)


def _between(low: float, high: float, marks: tuple[float, ...]) -> list[float]:
    """Round numbers, the first at most `low`, the last at least `high`, two at least."""
    first, last = int(np.floor(np.log10(low))), int(np.floor(np.log10(high))) + 1
    listed = [float(f"{m:g}e{d}") for d in range(first, last + 1) for m in marks]
    begin = max(i for i, mark in enumerate(listed) if mark <= low * (1.0 + 1e-12))
    end = min(i for i, mark in enumerate(listed) if mark >= high and i > begin)
    return listed[begin : end + 1]


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


HATCH = "////"
LABEL_IN = 0.68  # of the scale, for "≤ 300 µm" and a gap
MOST_POSES = 300  # drawn as points: of more, every n-th


def paint_cells(axes: Axes, grid: Grid, values_m: Floats, steps: Steps) -> None:
    """Values (across, up) in their colours; NaN is left out."""
    step = steps.of(values_m)
    for k, colour in enumerate(steps.colours):
        if np.any(step == k):  # the thin line of the same colour closes the seams that some readers show
            axes.add_patch(PathPatch(_outline(grid, step == k), fc=colour, ec=colour, lw=0.3))


def paint_unsupported(axes: Axes, grid: Grid, cells: Bools) -> None:
    """Hatching over cells (across, up)."""
    if np.any(cells):
        axes.add_patch(PathPatch(_outline(grid, cells), fc="none", ec=Tone.SOFT.value, hatch=HATCH, lw=0.0))


def paint_poses(axes: Axes, grid: Grid, points_m: Floats) -> None:
    """Where the poses of the session were."""
    some = grid.view.flat(points_m[:: _stride(len(points_m))])
    paper, ink = Tone.PAPER.value, Tone.INK.value
    axes.plot(*some.T, "o", ms=2.6, mfc=paper, mec=ink, mew=0.5, zorder=4)


def paint_measured(axes: Axes, grid: Grid, points_m: Floats, values_m: Floats, steps: Steps) -> None:
    """A point a pose in the colour of its error, the largest on top; of many, every n-th."""
    some = np.arange(0, len(values_m), _stride(len(values_m)))
    order = some[np.argsort(values_m[some])]
    flat, step = grid.view.flat(points_m[order]), steps.of(values_m[order])
    for k, colour in enumerate(steps.colours):
        own = flat[step == k]
        if len(own):
            axes.plot(*own.T, "o", ms=3.6, mfc=colour, mec=Tone.INK.value, mew=0.25, zorder=4 + k)


def _stride(count: int) -> int:
    """Every so many of `count` poses are drawn; also where no pose has a value."""
    return max(1, -(-count // MOST_POSES))


def dress(axes: Axes, grid: Grid, title: str, what: str, *, first: bool) -> None:
    """Title, axes of equal scale, the base as a cross; the first of a view gives heights and what the row shows."""
    left, right, bottom, top = grid.box_m
    axes.set(xlim=(left, right), ylim=(bottom, top), title=title, xlabel=grid.view.across)
    axes.grid(visible=False)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, prune="upper"))  # the last would run into the next picture's
    axes.plot(0.0, 0.0, "+", ms=9, mew=1.4, color=Tone.INK.value, zorder=20)
    if first:
        axes.set_ylabel(f"{what}\n{grid.view.up}" if what else grid.view.up)
    axes.tick_params(labelleft=first)


def scale_bar(figure: Figure, axes: Axes, steps: Steps, says: str) -> None:
    """What the colours mean."""
    norm = BoundaryNorm(steps.bounds_m, len(steps.colours))
    mapped = ScalarMappable(norm, ListedColormap(list(steps.colours)))
    bar = figure.colorbar(mapped, cax=axes, orientation="horizontal", spacing="uniform")
    wide_in = axes.get_position().width * figure.get_figwidth()
    every = -(-len(steps.bounds_m) * LABEL_IN // wide_in)
    labels = [length(bound, 2) if i % every == 0 else "" for i, bound in enumerate(steps.bounds_m)]
    if steps.open_below:
        labels[0] = f"≤ {labels[0]}"
    bar.set_ticks(list(steps.bounds_m), labels=labels)
    bar.set_label(says)
    bar.outline.set_linewidth(0.6)  # pyright: ignore[reportCallIssue, reportAttributeAccessIssue] - a Spine


def _outline(grid: Grid, cells: Bools) -> Path:
    """Rectangles of cells side by side in one path, runs upwards joined."""
    left, _, bottom, _ = grid.box_m
    c = grid.cell_m
    vertices: list[tuple[float, float]] = []
    for i, column in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]]).astype(int)))
        for begin, end in edges.reshape(-1, 2).tolist():
            x0, x1, y0, y1 = left + i * c, left + (i + 1) * c, bottom + begin * c, bottom + end * c
            vertices += [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY] * (len(vertices) // 5)
    return Path(vertices, codes)
