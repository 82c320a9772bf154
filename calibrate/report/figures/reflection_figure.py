"""The fixture close up, with both faces on edge: how the beam goes from face to face, in either order."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibrate.model.observations import Observations
from calibrate.report.elements.html import Html
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import Tone
from calibrate.report.figures.rig_scene import FittedRig, most_centred

Floats = NDArray[np.float64]

SHOWN = 40  # beams behind the two that stand out; more only blacken the picture
IN_FRONT = 0.8  # of the distance between the faces: how much of the arriving beam is shown


def reflection(rig: FittedRig, data: Observations, placement: int) -> Html:
    """Beams of one placement in the plane that is square to both faces."""
    says = f"the two faces of the fixture at station {placement} seen on edge, with the beam reflected between them"
    return drawn("rig-close", says, 3.6, 3.45, lambda figure: _paint(figure, rig, data, placement))


def _paint(figure: Figure, rig: FittedRig, data: Observations, placement: int) -> None:
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.axis("off")
    faces = rig.faces(placement)
    origin_m, view = _on_edge(faces)
    for rows, style in (
        (_behind(data, placement), {"lw": 0.6, "alpha": 0.22}),
        (_leading(data, placement), {"lw": 1.8}),
    ):
        for pose in rows:
            _beam(axes, (_path(rig, data, pose) - origin_m) @ view * 1e3, int(data.first_psd[pose]), style)
    for number, T in enumerate(faces, start=1):
        _face(axes, T, number, rig.half_size_m, origin_m, view)
    _scale_bar(axes)


def _on_edge(faces: Floats) -> tuple[Floats, Floats]:
    """Middle of both faces (3,), and (3, 2) right and up in the plane of both normals, opening to the right."""
    apart = faces[1, :3, 3] - faces[0, :3, 3]
    across = np.cross(faces[0, :3, 2], faces[1, :3, 2])
    if np.linalg.norm(across) < 1e-3:  # faces that look straight at each other
        across = np.cross(faces[0, :3, 2], apart)
    across /= np.linalg.norm(across)
    right = faces[0, :3, 2] + faces[1, :3, 2]
    if np.linalg.norm(right) < 1e-3:
        right = np.cross(across, apart)
    right /= np.linalg.norm(right)
    return faces[:, :3, 3].mean(axis=0), np.stack([right, np.cross(across, right)], axis=1)


def _leading(data: Observations, placement: int) -> list[int]:
    orders = sorted(set(data.first_psd[data.placement == placement].tolist()))
    return [most_centred(data, placement, first) for first in orders]


def _behind(data: Observations, placement: int) -> list[int]:
    rows = np.flatnonzero(data.placement == placement)
    return rows[:: max(1, -(-len(rows) // SHOWN))].tolist()


def _path(rig: FittedRig, data: Observations, pose: int) -> Floats:
    """(3, 3) m: some way in front of the first face, first spot, second spot."""
    points = rig.struck_m(int(data.placement[pose]), int(data.first_psd[pose]), data.spots_m[pose])
    _, direction = rig.assumed.beam(data.q_rad[pose])
    return np.stack([points[0] - IN_FRONT * float(np.linalg.norm(points[1] - points[0])) * direction, *points])


def _beam(axes: Axes, path_mm: Floats, first_psd: int, style: dict[str, float]) -> None:
    tone, dashes = (Tone.BEAM, "solid") if first_psd == 1 else (Tone.PLACE_1, (0, (5, 2)))
    leads = "alpha" not in style
    axes.plot(*path_mm.T, color=tone.value, linestyle=dashes if leads else "solid", zorder=4 if leads else 2, **style)  # pyright: ignore[reportArgumentType]
    if not leads:
        return
    for a, b in itertools.pairwise(path_mm):
        axes.annotate(
            "", 0.62 * b + 0.38 * a, 0.5 * (a + b), arrowprops={"arrowstyle": "-|>", "color": tone.value, "lw": 1.2}
        )
    words = f"PSD {first_psd} first"
    axes.annotate(words, path_mm[0], (6, 0), textcoords="offset points", color=tone.value, fontsize=10, va="center")


def _face(axes: Axes, T: Floats, number: int, half_m: float, origin_m: Floats, view: Floats) -> None:
    """A face on edge with a hatched back."""
    middle, normal = (T[:3, 3] - origin_m) @ view * 1e3, T[:3, 2] @ view
    along = np.array([-normal[1], normal[0]]) * half_m * 1e3
    back = middle - normal * 1.6
    corners = np.stack([middle + along, middle - along, back - along, back + along])
    axes.fill(*corners.T, color=Tone.INK.value, zorder=5)
    x, y = middle - normal * 3.0
    side = "right" if normal[0] > 0.2 else "left" if normal[0] < -0.2 else "center"
    height = "bottom" if normal[1] < -0.2 else "top" if normal[1] > 0.2 else "center"
    axes.text(x, y, f"PSD {number}", ha=side, va=height, fontsize=10, fontweight="bold")


def _scale_bar(axes: Axes) -> None:
    """20 mm at the lower left, below everything drawn."""
    left, bottom = axes.get_xlim()[0], axes.get_ylim()[0]
    axes.plot([left, left + 20.0], [bottom, bottom], color=Tone.SOFT.value, lw=2.0)
    axes.text(left + 10.0, bottom - 1.5, "20 mm", ha="center", va="top", fontsize=10, color=Tone.SOFT.value)
