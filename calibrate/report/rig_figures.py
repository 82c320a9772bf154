"""Pictures of the rig: from the side in parallel projection, from above, and the reflection close up."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from calibrate.report.elements import Html
from calibrate.report.rig_scene import Scene, StandingArm
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone, tone_of

Floats = NDArray[np.float64]

TILE_M = 0.2  # of the floor
ELEVATION_RAD = math.radians(22.0)
ABOVE_RAD = math.radians(90.0)
TRIAD_M = 0.12


def oblique(scene: Scene) -> Html:
    """The whole rig from the side that shows it widest."""
    view = _camera(_widest_azimuth(scene), ELEVATION_RAD)
    says = "the arm at one pose of every placement, with fixture faces and laser beam, seen from the side"
    return drawn("rig-oblique", says, 5.6, 4.7, lambda figure: _paint(figure, scene, view, shadow=True))


def from_above(scene: Scene) -> Html:
    """The same from above, x to the right."""
    view = _camera(-math.pi / 2.0, ABOVE_RAD)
    says = "the arm at one pose of every placement, with fixture faces and laser beam, seen from above"
    return drawn("rig-above", says, 4.6, 4.7, lambda figure: _paint(figure, scene, view, shadow=False))


def _camera(azimuth_rad: float, elevation_rad: float) -> Floats:
    """(3, 2) projection onto right and up for an eye in this direction, x being azimuth 0."""
    ca, sa, ce, se = math.cos(azimuth_rad), math.sin(azimuth_rad), math.cos(elevation_rad), math.sin(elevation_rad)
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce]]).T


def _points(scene: Scene) -> Floats:
    return np.concatenate([np.concatenate([a.bones_m, a.beam_m]) for a in scene.arms])


def _widest_azimuth(scene: Scene) -> float:
    """Of 24 directions the one in which arms and beams cover most of the picture."""
    points = _points(scene)

    def spread(azimuth_rad: float) -> float:
        flat = points @ _camera(azimuth_rad, ELEVATION_RAD)
        return float(np.linalg.det(np.cov(flat.T)))

    return max((math.radians(15.0 * k) for k in range(24)), key=spread)


def _paint(figure: Figure, scene: Scene, view: Floats, *, shadow: bool) -> None:
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.axis("off")
    _floor(axes, _points(scene), view)
    _triad(axes, view)
    for number, arm in reversed(list(enumerate(scene.arms))):
        _arm(axes, arm, view, tone_of(number), leading=number == 0, shadow=shadow)
    for number, (placement, corners) in enumerate(scene.faces_m.items()):
        _fixture(axes, corners, view, tone_of(number), f"place {placement}")


def _floor(axes: Axes, points: Floats, view: Floats) -> None:
    """Tiles in the plane z = 0 of the base, under everything."""
    low = np.floor((points[:, :2].min(axis=0) - 0.1) / TILE_M).clip(max=-1)
    high = np.ceil((points[:, :2].max(axis=0) + 0.1) / TILE_M).clip(min=1)
    for x in np.arange(low[0], high[0] + 1) * TILE_M:
        _line(axes, np.array([[x, low[1] * TILE_M, 0.0], [x, high[1] * TILE_M, 0.0]]) @ view, Tone.FAINT, 0.8)
    for y in np.arange(low[1], high[1] + 1) * TILE_M:
        _line(axes, np.array([[low[0] * TILE_M, y, 0.0], [high[0] * TILE_M, y, 0.0]]) @ view, Tone.FAINT, 0.8)


def _triad(axes: Axes, view: Floats) -> None:
    for axis, name in zip(np.eye(3) * TRIAD_M, "xyz", strict=True):
        tip = axis @ view
        if np.linalg.norm(tip) < 0.02:  # seen from its end
            continue
        _line(axes, np.array([[0.0, 0.0], tip]), Tone.SOFT, 1.2)
        axes.text(*(1.25 * tip), name, ha="center", va="center", fontsize=9, color=Tone.SOFT.value)


def _arm(axes: Axes, arm: StandingArm, view: Floats, tone: Tone, *, leading: bool, shadow: bool) -> None:
    bones, joints = arm.bones_m @ view, arm.axes_m @ view
    if shadow and leading:
        _line(axes, (arm.bones_m * [1.0, 1.0, 0.0]) @ view, Tone.FAINT, 5.0, solid_capstyle="round")
    if leading:
        _line(axes, bones, Tone.INK, 5.5, solid_capstyle="round")
        _line(axes, bones, Tone.PAPER, 2.6, solid_capstyle="round")
        axes.plot(*joints.T, "o", ms=10, mfc=Tone.PAPER.value, mec=Tone.INK.value, mew=1.3, zorder=3)
        for number, (x, y) in enumerate(joints, start=1):
            axes.text(x, y, str(number), ha="center", va="center_baseline", fontsize=7, zorder=4)
    else:
        _line(axes, bones, tone, 2.2, alpha=0.45, solid_capstyle="round")
    _line(axes, arm.beam_m @ view, Tone.BEAM, 1.6 if leading else 1.1, zorder=5)
    axes.plot(*(arm.beam_m[0] @ view), "o", ms=4, color=Tone.BEAM.value, zorder=5)


def _fixture(axes: Axes, corners_m: Floats, view: Floats, tone: Tone, name: str) -> None:
    """Both faces to scale, in a ring that lets them be found, and a line down to the floor."""
    middle = corners_m.mean(axis=(0, 1))
    _line(axes, np.stack([middle, middle * [1.0, 1.0, 0.0]]) @ view, tone, 0.9, linestyle=(0, (1, 2)))
    for corners in corners_m:
        axes.fill(*(corners @ view).T, color=tone.value, lw=1.0, zorder=6)
    x, y = middle @ view
    size = 2.2 * float(np.linalg.norm(corners_m - middle, axis=2).max())
    axes.add_patch(Circle((x, y), size, fill=False, ec=tone.value, lw=1.2, zorder=6))
    axes.text(x + size, y - size, name, color=tone.value, fontsize=10, fontweight="bold", va="top", zorder=7)


def _line(axes: Axes, points: Floats, tone: Tone, width: float, **style: object) -> None:
    axes.plot(points[:, 0], points[:, 1], color=tone.value, lw=width, **style)  # pyright: ignore[reportArgumentType]
