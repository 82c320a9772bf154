"""The drawing of a session on paper: the laser's ways from above and from the side, the cell, the joints' ranges."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.session.plan import PlanOptions
from calibeam.motion.figures import draw_cell, write_figure
from calibeam.motion.gate_of_rig import cell_of
from calibeam.motion.rehearsal import Rehearsal, rehearse
from calibrate.report.elements.tones import Tone, tone_of

Floats = NDArray[np.float64]

WAY_POINTS = 40  # of a way by joints, between two poses
MARGIN_M = 0.4  # round what is drawn; boxes may go on beyond it


def draw_session(rig: Rig, path: Path, options: PlanOptions, plan: PosePlan | None = None) -> str:
    """Leaves the drawing, an SVG; one sentence for a person: how many poses, what cannot be had, where it is drawn."""
    rehearsed = rehearse(rig, options, plan)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_figure(path, 13.0, 5.0, lambda figure: draw_rehearsal(figure, rehearsed, rig))
    return f"{rehearsed.says}; drawn in {path}"


def draw_rehearsal(figure: Figure, rehearsed: Rehearsal, rig: Rig) -> None:
    """Ways of the laser, or of the probe, one colour a place; the arm at home; crosses where a pose was refused."""
    above, side, joints = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 0.7))
    cell, tracks = cell_of(rig), _tracks(rehearsed, rig)
    home = rehearsed.arm.frames(rehearsed.home_rad[None])[0, :, :3, 3]
    refused = [stop.q_rad for stop in rehearsed.refused if stop.q_rad is not None]
    missed = _tips(rehearsed, rig, np.array(refused)) if refused else np.empty((0, 3))
    everything = np.concatenate([home, *tracks.values(), missed])
    for axes, (i, j), title in ((above, (0, 1), "From above"), (side, (0, 2), "From the side")):
        axes.plot(home[:, i], home[:, j], "-o", color=Tone.SOFT.value, markersize=3, label="arm at home")
        for place, points in tracks.items():
            name = "ways" if place is None else f"station {place}"
            axes.plot(points[:, i], points[:, j], color=_colour(place), linewidth=0.8, label=name)
        if len(missed):
            axes.plot(missed[:, i], missed[:, j], "x", color=Tone.BEAM.value, label="cannot be had")
        axes.set_xlim(everything[:, i].min() - MARGIN_M, everything[:, i].max() + MARGIN_M)
        axes.set_ylim(everything[:, j].min() - MARGIN_M, everything[:, j].max() + MARGIN_M)
        axes.set(xlabel=f"{'xyz'[i]}, m", ylabel=f"{'xyz'[j]}, m", title=title, aspect="equal")
        draw_cell(axes, cell, (i, j), everything)
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=6)
    _draw_ranges(joints, rehearsed)


def _draw_ranges(axes: Axes, rehearsed: Rehearsal) -> None:
    """What each joint uses of its range."""
    used = np.degrees(np.concatenate([rehearsed.home_rad[None], *rehearsed.ways]))
    lower, upper = np.degrees(rehearsed.arm.lower_rad), np.degrees(rehearsed.arm.upper_rad)
    for joint in range(used.shape[1]):
        axes.plot([lower[joint], upper[joint]], [joint + 1] * 2, color=Tone.FAINT.value, linewidth=8.0)
        axes.plot(
            [used[:, joint].min(), used[:, joint].max()], [joint + 1] * 2, color=Tone.PLACE_1.value, linewidth=4.0
        )
    axes.set(xlabel="deg", ylabel="joint", title="Used of each joint's range", yticks=range(1, used.shape[1] + 1))
    axes.invert_yaxis()


def _tracks(rehearsed: Rehearsal, rig: Rig) -> dict[int | None, Floats]:
    """(point, 3) m of the laser or probe along the ways, by place; a gap of NaN between two ways that do not meet."""
    out: dict[int | None, list[Floats]] = {}
    shares = np.linspace(0.0, 1.0, WAY_POINTS)[:, None]
    for way, place in zip(rehearsed.ways, rehearsed.places, strict=True):
        q_rad = way[0] + shares * (way[1] - way[0])
        out.setdefault(place, []).append(_tips(rehearsed, rig, q_rad))
    return {place: np.concatenate(points) for place, points in out.items()}


def _tips(rehearsed: Rehearsal, rig: Rig, q_rad: Floats) -> Floats:
    """(pose, 3) m of the laser's origin, of the probe, or of the flange."""
    point_m = np.array(rig.tool.laser_origin_m or rig.tool.point_m or (0.0, 0.0, 0.0))
    flange = rehearsed.arm.frames(q_rad)[:, -1]
    out: Floats = flange[:, :3, :3] @ point_m + flange[:, :3, 3]
    return out


def _colour(place: int | None) -> str:
    return tone_of(0 if place is None else place - 1).value
