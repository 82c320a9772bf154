"""The cell in a drawing of motion, and the colours of such drawings on white."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from acquisition.motion.cell import Box, Cell
from calibrate.report.tones import Tone

Floats = NDArray[np.float64]

PRINTED = {
    Tone.INK: "#111111", Tone.SOFT: "#555555", Tone.FAINT: "#dddddd", Tone.PAPER: "#ffffff", Tone.BEAM: "#cc3311",
    Tone.PLACE_1: "#0072b2", Tone.PLACE_2: "#e69f00", Tone.PLACE_3: "#009e73", Tone.PLACE_4: "#cc79a7",
    Tone.PLACE_5: "#56b4e9", Tone.PLACE_6: "#d55e00",
}  # fmt: skip


def draw_cell(axes: Axes, cell: Cell, plane: tuple[int, int], drawn_m: Floats) -> None:
    """Keep-out boxes filled, slow areas outlined, each with its name; limits of the axes stay.

    A box beside all that is drawn (point, 3), as a table seen from above, would only cover it, and is left out.
    """
    axes.apply_aspect()
    slow = [(area.box, f"{area.box.name}, {area.speed_m_s:g} m/s") for area in cell.slow]
    _boxes(axes, plane, drawn_m, [(box, box.name) for box in cell.keep_out], "keep out", (Tone.BEAM.value, 0.15))
    _boxes(axes, plane, drawn_m, slow, "slow area", (Tone.SOFT.value, 0.0))


def _boxes(
    axes: Axes,
    plane: tuple[int, int],
    drawn_m: Floats,
    named: list[tuple[Box, str]],
    kind: str,
    colour: tuple[str, float],
) -> None:
    """`kind`: in the legend, once. `colour`: its alpha is that of the filling."""
    across = next(k for k in range(3) if k not in plane)
    low_m, high_m = drawn_m[:, across].min(), drawn_m[:, across].max()
    for box, name in named:
        if box.lower_m[across] <= high_m and box.upper_m[across] >= low_m:
            _box(axes, box, plane, (name, kind), colour)
            kind = "_"


def _box(axes: Axes, box: Box, plane: tuple[int, int], names: tuple[str, str], colour: tuple[str, float]) -> None:
    """`names`: beside the box, and in the legend."""
    (x0, y0), (x1, y1) = ([corner[k] for k in plane] for corner in (box.lower_m, box.upper_m))
    # Artists, not patches of the data: the limits stay.
    axes.add_artist(Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor=colour[0], alpha=colour[1], linewidth=0.0))
    edge = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=colour[0], linestyle="--", linewidth=1.0)
    edge.set_label(names[1])
    axes.add_artist(edge)
    seen_x, seen_y = np.clip((x0, x1), *axes.get_xlim()), np.clip((y0, y1), *axes.get_ylim())
    if seen_x[1] > seen_x[0] and seen_y[1] > seen_y[0]:
        axes.text(seen_x[0], seen_y[1], f" {names[0]}", color=colour[0], fontsize=7, va="top", clip_on=True)
