"""The error over the workspace before and after, predicted and where poses were measured, all on one scale."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibrate.report.elements import Html
from calibrate.report.svg import drawn
from calibrate.report.workspace.cell_figure import (
    dress,
    paint_cells,
    paint_measured,
    paint_poses,
    paint_unsupported,
    scale_bar,
)
from calibrate.report.workspace.room import Room
from calibrate.report.workspace.scale import Steps, steps_for
from calibrate.report.workspace.sections import VIEWS, Grid, grid_of
from calibrate.report.workspace.sheet import Sheet

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Measured:
    """Errors at poses of the session."""

    points_m: Floats  # (row, 3) of the target in the base
    drawn_m: Floats  # (row,) distance of measured from expected, arm as drawn, frames where they fit best
    found_m: Floats  # (row,) the same for the identified arm, predicted from all other rows


@dataclass(frozen=True)
class Layer:
    """One picture: values of cells by view, or of points."""

    title: str
    cells_m: tuple[Floats, ...]  # one a view; empty for points
    points_m: Floats | None = None
    values_m: Floats | None = None


def before_and_after(room: Room, measured: Measured | None) -> Html:
    """Both views of both states; in a second row what was measured."""
    grids = tuple(grid_of(view, room.reach_m) for view in VIEWS)
    rows = {"predicted": _predicted(room, grids)}
    if measured is not None:
        titles = ("as drawn", "identified")
        values = (measured.drawn_m, measured.found_m)
        rows["measured"] = [Layer(t, (), measured.points_m, v) for t, v in zip(titles, values, strict=True)]
    says = "predicted error of the target over the workspace, as drawn and identified, from the side and from above"
    return pictures("workspace", says, room, grids, rows, "error of the target")


def _predicted(room: Room, grids: tuple[Grid, ...]) -> list[Layer]:
    states = (("as drawn", room.drawn_m), ("identified", room.found_m))
    return [
        Layer(title, tuple(grid.rms(room.points_m, values, room.supported) for grid in grids))
        for title, values in states
    ]


def pictures(
    name: str, says: str, room: Room, grids: tuple[Grid, ...], rows: Mapping[str, list[Layer]], scale_says: str
) -> Html:
    """Rows of layers by what they are, each layer in every view, with one scale for all."""
    layers = [layer for row in rows.values() for layer in row]
    values = [np.concatenate([c.ravel() for c in layer.cells_m]) for layer in layers if layer.cells_m]
    values += [layer.values_m for layer in layers if layer.values_m is not None]
    steps = steps_for(np.concatenate(values))
    sheet = Sheet(grids, len(layers) // len(rows), len(rows))

    def paint(figure: Figure) -> None:
        figure.set_layout_engine("none")
        for number, (what, row) in enumerate(rows.items()):
            for view, places in enumerate(sheet.axes(figure, number)):
                for k, (axes, layer) in enumerate(zip(places, row, strict=True)):
                    _paint(axes, room, grids[view], layer, view, steps)
                    dress(axes, grids[view], layer.title, what if view == 0 else "", first=k == 0)
        key = f"{scale_says}; hatched: not supported by these poses; circles: poses of the session; +: base"
        scale_bar(figure, sheet.bar(figure), steps, key)

    return drawn(name, says, *sheet.size_in, paint)


def _paint(axes: Axes, room: Room, grid: Grid, layer: Layer, view: int, steps: Steps) -> None:
    if layer.cells_m:
        paint_cells(axes, grid, layer.cells_m[view], steps)
        paint_unsupported(axes, grid, grid.reached(room.reach_m) & np.isnan(layer.cells_m[view]))
        paint_poses(axes, grid, room.session_m)
    elif layer.points_m is not None and layer.values_m is not None:
        paint_measured(axes, grid, layer.points_m, layer.values_m, steps)
