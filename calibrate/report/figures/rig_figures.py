"""Pictures of the rig: from the side in parallel projection, and from above."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from calibrate.report.elements.html import Html
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import Tone, tone_of
from calibrate.report.figures.rig_scene import Scene, StandingArm

Floats = NDArray[np.float64]

TILE_M = 0.2  # of the floor
ELEVATION_RAD = math.radians(22.0)
ABOVE_RAD = math.radians(90.0)
TRIAD_M = 0.12
STAND_M = 0.075  # radius of the base ring, of the picture only
APART_M = 0.3  # two fixtures this far apart in the picture do not hide each other
TRIAD_NAME = 1.25  # of the axis' length: where its name stands
WIDTH_IN = 4.8
LABEL_IN = 0.22  # between the discs of two joints: 13 points and a gap
SPREAD_ROUNDS = 100


def oblique(scene: Scene) -> Html:
    """The whole rig from the side that shows it best."""
    view = _camera(_best_azimuth(scene), ELEVATION_RAD)
    says = "the arm at one pose of every station, with fixture faces and laser beam, seen from the side"
    return drawn("rig-oblique", says, WIDTH_IN, _height_in(scene, view), lambda figure: _paint(figure, scene, view))


def from_above(scene: Scene) -> Html:
    """The same from above, x to the right."""
    view = _camera(-math.pi / 2.0, ABOVE_RAD)
    says = "the arm at one pose of every station, with fixture faces and laser beam, seen from above"
    return drawn("rig-above", says, WIDTH_IN, _height_in(scene, view), lambda figure: _paint(figure, scene, view))


def _camera(azimuth_rad: float, elevation_rad: float) -> Floats:
    """(3, 2) projection onto right and up for an eye in this direction, x being azimuth 0."""
    ca, sa, ce, se = math.cos(azimuth_rad), math.sin(azimuth_rad), math.cos(elevation_rad), math.sin(elevation_rad)
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce]]).T


def _points(scene: Scene) -> Floats:
    return np.concatenate([np.concatenate([a.bones_m, a.beam_m]) for a in scene.arms])


def _height_in(scene: Scene, view: Floats) -> float:
    """Height of the picture that the drawing fills, floor included."""
    wide, tall = _extent_m(_points(scene), view)
    return float(np.clip(WIDTH_IN * tall / wide, 0.6 * WIDTH_IN, 0.74 * WIDTH_IN))


def _extent_m(points: Floats, view: Floats) -> Floats:
    """(2,) width and height of everything and the floor below it."""
    low, high, level = _floor_extent(points)
    corners = np.array([[x, y, level] for x in (low[0], high[0]) for y in (low[1], high[1])])
    return np.ptp(np.concatenate([points, corners]) @ view, axis=0)


def _best_azimuth(scene: Scene) -> float:
    """Of 24 directions the one in which arms and beams fill the picture and no fixture hides another."""
    points = _points(scene)
    middles = np.stack([corners.mean(axis=(0, 1)) for corners in scene.faces_m.values()])

    def merit(azimuth_rad: float) -> float:
        view = _camera(azimuth_rad, ELEVATION_RAD)
        flat = middles @ view
        apart = np.linalg.norm(flat[:, None] - flat[None], axis=2)[np.triu_indices(len(flat), 1)]
        return float(np.linalg.det(np.cov((points @ view).T))) * float(apart.min(initial=APART_M))

    return max((math.radians(15.0 * k) for k in range(24)), key=merit)


def _floor_extent(points: Floats) -> tuple[Floats, Floats, float]:
    """Corners (2,), (2,) and height of the floor: whole tiles round everything, below the lowest point."""
    low = np.floor((points[:, :2].min(axis=0) - 0.05) / TILE_M).clip(max=-1) * TILE_M
    high = np.ceil((points[:, :2].max(axis=0) + 0.05) / TILE_M).clip(min=1) * TILE_M
    return low, high, min(0.0, 0.1 * math.floor(float(points[:, 2].min()) / 0.1))


def _paint(figure: Figure, scene: Scene, view: Floats) -> None:
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.axis("off")
    points = _points(scene)
    level = _floor(axes, points, view)
    _line(axes, _on_floor(scene.arms[0].bones_m, level) @ view, Tone.FAINT, 5.0, solid_capstyle="round")
    _base(axes, view, level)
    for number, arm in reversed(list(enumerate(scene.arms))):
        _arm(axes, arm, view, tone_of(number), leading=number == 0)
    _numbered_joints(axes, scene.arms[0], view, LABEL_IN * float(_extent_m(points, view)[0]) / WIDTH_IN)
    centre = points.mean(axis=0) @ view
    for number, (placement, corners) in enumerate(scene.faces_m.items()):
        _fixture(axes, corners, view, tone_of(number), level)
        _name(axes, corners, view, tone_of(number), f"station {placement}", centre)


def _floor(axes: Axes, points: Floats, view: Floats) -> float:
    """Tiles under everything; their height."""
    low, high, level = _floor_extent(points)
    for x in np.arange(low[0], high[0] + TILE_M / 2, TILE_M):
        _line(axes, np.array([[x, low[1], level], [x, high[1], level]]) @ view, Tone.FAINT, 0.8)
    for y in np.arange(low[1], high[1] + TILE_M / 2, TILE_M):
        _line(axes, np.array([[low[0], y, level], [high[0], y, level]]) @ view, Tone.FAINT, 0.8)
    return level


def _on_floor(points_m: Floats, level_m: float) -> Floats:
    return points_m * [1.0, 1.0, 0.0] + [0.0, 0.0, level_m]


def _base(axes: Axes, view: Floats, level_m: float) -> None:
    """The base frame's axes, and the stand that carries it."""
    turn = np.linspace(0.0, 2.0 * math.pi, 49)
    ring = STAND_M * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    for height in {level_m, 0.0}:
        _line(axes, (ring + np.array([0.0, 0.0, height])) @ view, Tone.SOFT, 1.0)
    for side in (view[:, 0], -view[:, 0]):
        edge = STAND_M * side
        _line(axes, np.stack([edge, _on_floor(edge, level_m)]) @ view, Tone.SOFT, 1.0)
    for axis, name in zip(np.eye(3) * TRIAD_M, "xyz", strict=True):
        tip = axis @ view
        if np.linalg.norm(tip) > 0.02:  # else seen from its end
            _line(axes, np.array([[0.0, 0.0], tip]), Tone.SOFT, 1.2)
            x, y = TRIAD_NAME * tip
            axes.text(float(x), float(y), name, ha="center", va="center", fontsize=10, color=Tone.SOFT.value)


def _triad_names(view: Floats) -> Floats:
    """(axis, 2) where the names of the base's axes stand."""
    return TRIAD_NAME * (np.eye(3) * TRIAD_M) @ view


def _arm(axes: Axes, arm: StandingArm, view: Floats, tone: Tone, *, leading: bool) -> None:
    bones = arm.bones_m @ view
    if leading:
        _line(axes, bones, Tone.INK, 5.5, solid_capstyle="round")
        _line(axes, bones, Tone.PAPER, 2.6, solid_capstyle="round")
    else:
        _line(axes, bones, tone, 2.2, alpha=0.45, solid_capstyle="round")
    _line(axes, arm.beam_m @ view, Tone.BEAM, 1.6 if leading else 1.1, zorder=5)
    axes.plot(*(arm.beam_m[0] @ view), "o", ms=4, color=Tone.BEAM.value, zorder=5)


def _numbered_joints(axes: Axes, arm: StandingArm, view: Floats, least_m: float) -> None:
    """A numbered disc at every joint; of joints one behind the other they stand side by side, each tied to its own."""
    joints = arm.axes_m @ view
    discs = spread(joints, _triad_names(view), least_m)
    for joint, disc in zip(joints, discs, strict=True):
        _line(axes, np.stack([joint, disc]), Tone.INK, 1.0, zorder=3)
    axes.plot(*discs.T, "o", ms=13, mfc=Tone.PAPER.value, mec=Tone.INK.value, mew=1.3, zorder=3)
    for number, (x, y) in enumerate(discs, start=1):
        axes.text(x, y, str(number), ha="center", va="center_baseline", fontsize=10, zorder=4)


def spread(points: Floats, fixed: Floats, least: float) -> Floats:
    """Points (n, 2) moved as little as it takes to be `least` from each other and from the `fixed` (m, 2)."""
    out = points.astype(np.float64)
    n = len(out)
    for _ in range(SPREAD_ROUNDS):
        everything = np.concatenate([out, fixed])
        gap = everything[:n, None] - everything[None]
        away = np.linalg.norm(gap, axis=2)
        near = (away < least) & ~np.eye(n, len(everything), dtype=bool)
        if not near.any():
            break
        order = np.arange(n)[:, None] - np.arange(len(everything))[None]
        aside = np.where(order[..., None] > 0, 1.0, -1.0) * np.array([1.0, 0.0])  # of two in one place
        unit = np.where(away[..., None] > 1e-9 * least, gap / np.maximum(away, 1e-9 * least)[..., None], aside)
        share = np.where(np.arange(len(everything)) < n, 0.5, 1.0)  # what is fixed does not give way
        push = np.where(near, 1.02 * least - away, 0.0) * share
        out = out + np.sum(push[..., None] * unit, axis=1)
    return out


def _fixture(axes: Axes, corners_m: Floats, view: Floats, tone: Tone, level_m: float) -> None:
    """Both faces to scale, in a ring that lets them be found, and a line down to the floor."""
    middle = corners_m.mean(axis=(0, 1))
    _line(axes, np.stack([middle, _on_floor(middle, level_m)]) @ view, tone, 0.9, linestyle=(0, (1, 2)))
    for corners in corners_m:
        axes.fill(*(corners @ view).T, facecolor=tone.value, edgecolor=tone.value, lw=1.0, zorder=6)
    x, y = middle @ view
    axes.add_patch(Circle((float(x), float(y)), _ring_m(corners_m), fill=False, ec=tone.value, lw=1.2, zorder=6))


def _ring_m(corners_m: Floats) -> float:
    return 1.5 * float(np.linalg.norm(corners_m - corners_m.mean(axis=(0, 1)), axis=2).max())


def _name(axes: Axes, corners_m: Floats, view: Floats, tone: Tone, name: str, centre: Floats) -> None:
    """Beside the ring, on the side away from the middle of the picture."""
    middle, size = corners_m.mean(axis=(0, 1)) @ view, _ring_m(corners_m)
    right, up = bool(middle[0] >= centre[0]), bool(middle[1] >= centre[1])
    x, y = middle + 0.78 * size * np.array([1.0 if right else -1.0, 1.0 if up else -1.0])
    axes.text(
        float(x),
        float(y),
        name,
        ha="left" if right else "right",
        va="bottom" if up else "top",
        color=tone.value,
        fontsize=10,
        fontweight="bold",
        zorder=7,
    )


def _line(axes: Axes, points: Floats, tone: Tone, width: float, **style: object) -> None:
    axes.plot(points[:, 0], points[:, 1], color=tone.value, lw=width, **style)  # pyright: ignore[reportArgumentType]
