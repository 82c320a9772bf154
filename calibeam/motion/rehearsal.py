"""A session on paper: every pose of its plan and the way there, gone through the gate before the arm moves; and its
drawing: the ways of the laser from above and from the side, the cell, the ranges of the joints.

Poses are where the rig file assumes arm and places to be. The arm that is met is known better from pose to pose, so
the true ways differ by what zeros of degrees do; each passes the same gate again when it is made.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from acquisition.centring.aim import BeamTarget, flange_for, reach
from acquisition.centring.navigator import FINDING_STAND_OFF_M
from acquisition.errors import RefusedMotionError, UnreachableError
from acquisition.motion.under_way import GatedArm
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.session.plan import PlanOptions, blocks
from calibeam.learner import FittedLearner
from calibeam.motion.figures import draw_cell, write_figure
from calibeam.motion.gate_of_rig import cell_of
from calibrate.model.arms.rig_arm import RigArm
from calibrate.report.elements.tones import Tone, tone_of

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RehearsedPose:
    """One pose of a plan: where, and the readings (joint,); `why`: it cannot be had."""

    placement: int | None
    name: str
    q_rad: Floats | None
    why: str = ""


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """The stops in order; `ways` (pose, joint) from one that was had to the next, `places` their fixture places."""

    arm: RigArm
    home_rad: Floats
    stops: tuple[RehearsedPose, ...]
    ways: tuple[Floats, ...]
    places: tuple[int | None, ...]

    @property
    def refused(self) -> tuple[RehearsedPose, ...]:
        return tuple(stop for stop in self.stops if stop.why)

    @property
    def says(self) -> str:
        """For a person, the first refused pose with its reason."""
        places = len({stop.placement for stop in self.stops})
        summary = f"{len(self.stops)} poses at {places} station{'' if places == 1 else 's'}"
        if not self.refused:
            return f"{summary}, all within reach and clear of the keep-out boxes"
        first = self.refused[0]
        return f"{summary}, {len(self.refused)} of them are not possible, the first: {first.name}: {first.why}"


@dataclass
class PaperArm:
    """Implements drivers.device.Movable: it is where it was sent, at once."""

    q_rad: Floats
    name: str = "robot"
    ways: list[Floats] = field(default_factory=list[Floats])

    def connect(self) -> None: ...

    def move_joints(self, q_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        self.ways.append(np.stack([self.q_rad, q_rad]))
        self.q_rad = q_rad

    def stop(self, deceleration_rad_s2: float = 0.0) -> None: ...

    def hold(self) -> None: ...

    def close(self) -> None: ...


def rehearse(rig: Rig, options: PlanOptions, plan: PosePlan | None = None) -> Rehearsal:
    """What a session of `options`, or of a plan of poses, is about to do, from the rig's home_rad on."""
    arm = RigArm.of_rig(rig)
    home_rad = np.zeros(rig.n_joints) if rig.motion.home_rad is None else np.array(rig.motion.home_rad)
    paper = PaperArm(home_rad)
    gated = GatedArm(paper, arm, cell_of(rig), lambda: paper.q_rad)
    stops, places = list[RehearsedPose](), list[int | None]()
    wanted = _aimed(rig, options, paper) if plan is None else _planned(plan)
    for stop in wanted:
        said = stop
        if stop.q_rad is not None:
            try:
                gated.move_joints(stop.q_rad, rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
                places.append(stop.placement)
            except RefusedMotionError as why:
                said = RehearsedPose(stop.placement, stop.name, stop.q_rad, str(why))
        stops.append(said)
    return Rehearsal(arm, home_rad, tuple(stops), tuple(paper.ways), tuple(places))


def _aimed(rig: Rig, options: PlanOptions, paper: PaperArm) -> Iterator[RehearsedPose]:
    """Poses of a session that aims: every block begins where the light is looked for."""
    learner, rng = FittedLearner(rig), np.random.default_rng(options.seed)
    for block in blocks(tuple(rig.placements), learner.optics.half_size_m, options):
        T = learner.T_base_fixture(block.placement)
        finding = BeamTarget(block.first, (0.0, 0.0, 0.0, 0.0), FINDING_STAND_OFF_M, block.visits[0].target.roll_rad)
        targets = [("the aim", finding), *((f"pose {visit.index + 1}", visit.target) for visit in block.visits)]
        for number, target in targets:
            name = f"station {block.placement}, PSD {block.first} first, {number}"
            try:
                q_rad = reach(learner.arm, flange_for(learner.arm, learner.optics, T, target), paper.q_rad, rng)
            except UnreachableError as why:
                yield RehearsedPose(block.placement, name, None, str(why))
                continue
            yield RehearsedPose(block.placement, name, q_rad)


def _planned(plan: PosePlan) -> Iterable[RehearsedPose]:
    for number, block in enumerate(plan.block, start=1):
        for index, pose in enumerate(block.pose, start=1):
            yield RehearsedPose(block.placement, f"block {number}, pose {index}", np.array(pose.q_rad))


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
