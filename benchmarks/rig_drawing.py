"""The drawing of the rig in the README: fixture in section and cell from above, to scale, from the rig file's numbers.

`python -m benchmarks.rig_drawing rigs/ur5e-dual-psd.toml docs/figures/rig.svg`
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Rig, load_rig

Floats = NDArray[np.float64]
BEAM, FACE, QUIET = "#b00020", "#1f2933", "#6b7280"
REACH_M = 0.85  # of a UR5e, by its data sheet
INCOMING_MM = 60.0  # of the beam that is drawn before the first face


def draw(rig: Rig, path: Path) -> None:
    """An SVG of two views. ValueError where the rig has no fixture of two faces."""
    if rig.fixture is None:
        raise ValueError(f"rig {rig.name}: no [fixture] to draw")
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "rig", "font.family": "sans-serif", "font.size": 9}):
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        _section(left, rig)
        _from_above(right, rig)
        figure.savefig(path, format="svg", metadata={"Date": None}, facecolor="white")


def _section(axes: Axes, rig: Rig) -> None:
    """y and z of PSD 1, through both centres, mm."""
    fixture = rig.fixture
    assert fixture is not None
    half_mm = 1e3 * fixture.half_size_m
    second_mm = 1e3 * np.array(fixture.psd2_in_psd1.origin_m)[1:]
    turned = Rotation.from_rotvec(fixture.psd2_in_psd1.rotation_rad).as_matrix()
    for number, centre, along in ((1, np.zeros(2), np.array([1.0, 0.0])), (2, second_mm, turned[1:, 1])):
        ends = np.array([centre - half_mm * along, centre + half_mm * along])
        axes.plot(*ends.T, color=FACE, linewidth=5.0, solid_capstyle="butt")
        shift = np.array([0.0, -9.0]) if number == 1 else np.array([0.0, 15.0])
        axes.annotate(f"PSD {number}, face {2 * half_mm:.0f} × {2 * half_mm:.0f} mm", _at(centre + shift), ha="center")
    distance_mm = float(np.hypot(*second_mm))
    to_second = second_mm / distance_mm
    incoming = np.array([-to_second[0], to_second[1]])
    for start, end in ((INCOMING_MM * incoming, np.zeros(2)), (np.zeros(2), second_mm)):
        axes.annotate("", _at(end), _at(start), arrowprops={"arrowstyle": "-|>", "color": BEAM, "linewidth": 1.6})
    axes.plot([0.0, 0.0], [0.0, 45.0], color=QUIET, linewidth=0.8, linestyle="--")
    angle_deg = float(np.degrees(np.arctan2(to_second[0], to_second[1])))
    axes.annotate(f"{angle_deg:.0f}°", (4.0, 30.0), color=QUIET)
    axes.annotate(f"{angle_deg:.0f}°", (-12.0, 30.0), color=QUIET)
    axes.annotate(f"{distance_mm:.0f} mm", _at(0.5 * second_mm + np.array([5.0, -6.0])), color=BEAM)
    axes.annotate("laser on the flange", _at(INCOMING_MM * incoming + np.array([0.0, 4.0])), ha="center", color=BEAM)
    _dimension(axes, (0.0, -18.0), (second_mm[0], -18.0), f"{second_mm[0]:.1f} mm")
    _dimension(axes, (72.0, 0.0), (72.0, second_mm[1]), f"{second_mm[1]:.1f} mm", upright=True)
    axes.set(title="Fixture, section through both centres", xlim=(-62.0, 92.0), ylim=(-30.0, 95.0), aspect="equal")
    axes.set_axis_off()


def _from_above(axes: Axes, rig: Rig) -> None:
    """Base, reach and stations of the fixture, m."""
    around = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(REACH_M * np.cos(around), REACH_M * np.sin(around), color=QUIET, linewidth=0.8, linestyle="--")
    axes.annotate(f"reach {REACH_M:.2f} m", (-0.45, -0.80), color=QUIET)
    axes.plot(0.0, 0.0, marker="o", markersize=16, color=FACE)
    axes.annotate("base", (0.0, -0.14), ha="center")
    for placement in rig.placement_list:
        x_m, y_m, z_m = placement.psd1_in_base.origin_m
        axes.plot(x_m, y_m, marker="s", markersize=7, color=BEAM)
        axes.annotate(f"{placement.id}: {x_m:.2f}, {y_m:.2f}, {z_m:.2f}", (x_m - 0.02, y_m + 0.06), ha="center")
    axes.annotate("", (0.30, -0.62), (0.0, -0.62), arrowprops={"arrowstyle": "-|>"})
    axes.annotate("x", (0.32, -0.64))
    axes.annotate("", (0.0, -0.32), (0.0, -0.62), arrowprops={"arrowstyle": "-|>"})
    axes.annotate("y", (-0.06, -0.36))
    axes.set(title="Cell from above: stations of PSD 1 (x, y, z in m)", xlim=(-0.95, 1.0), ylim=(-0.95, 0.95))
    axes.set_aspect("equal")
    axes.set_axis_off()


def _at(point: Floats) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _dimension(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], words: str, *, upright: bool = False
) -> None:
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<|-|>", "color": QUIET, "linewidth": 0.9})
    middle = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
    shift = (3.0, 0.0) if upright else (0.0, -7.0)
    axes.annotate(words, (middle[0] + shift[0], middle[1] + shift[1]), color=QUIET, ha="left" if upright else "center")


if __name__ == "__main__":
    draw(load_rig(Path(sys.argv[1])), Path(sys.argv[2]))
