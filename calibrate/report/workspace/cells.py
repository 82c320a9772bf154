"""How cells of a view are painted: one path a colour, hatching where nothing is known, poses as points."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from calibrate.report.quantities import length
from calibrate.report.tones import Tone
from calibrate.report.workspace.scale import Steps
from calibrate.report.workspace.sections import Grid

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

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
    """Title, axes of equal scale, the base as a cross; the first of a view tells heights and what the row shows."""
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
