"""Two calibrations of one arm side by side: what moved, what it does to the tool, and whether they can be compared.

What the change of the arm does to the tool: base and tool the same, only what both sessions determine is changed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import ArmModel, Rig
from calibrate.converted_rig import rig_in_model
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.model_file import ModelFile
from calibrate.parameters import index_of
from calibrate.report.drift.drawing import rig_of
from calibrate.report.drift.parameters import Change, Compared, compared, doubt_of
from calibrate.report.model_tests import repeated, scatter
from calibrate.report.verdict import UNLIKELY
from calibrate.report.workspace.known_arm import KnownArm
from calibrate.report.workspace.workspace_errors import Room, room_of, target_at
from calibrate.uncertainty.fit_statistics import Alarm
from calibrate.uncertainty.free_space import target_by_parameter

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Calibration:
    """One of the two: its model, and what else there is of it."""

    label: str  # when or where from, for a person
    model: ModelFile
    recording: Recording | None = None
    diagnosis: DiagnosisFile | None = None


@dataclass(frozen=True)
class ToolChange:
    """At the poses of a Room."""

    moved_m: Floats  # (pose,) distance between the tool now and then
    sigma_m: Floats  # (pose,) doubt of it, three axes together
    largest_m: float  # over the supported poses
    largest_sigma_m: float  # there


def tool_change(known: KnownArm, room: Room, changes: tuple[Change, ...], doubt: Floats) -> ToolChange:
    """`doubt` (change, change): covariance of the changes."""
    column = index_of(known.parameters)
    own = [column[c.name] for c in changes]
    then = known.theta.copy()
    then[own] -= np.array([c.change for c in changes])
    moved = np.linalg.norm(target_at(known, known.theta, room.q_rad) - target_at(known, then, room.q_rad), axis=1)
    J = target_by_parameter(known.arm, known, known.point_m, room.q_rad)[1][..., own]
    sigma = np.sqrt(np.maximum(np.einsum("nip,pq,niq->n", J, doubt, J, optimize=True), 0.0))
    worst = int(np.argmax(np.where(room.supported, moved, -1.0)))
    return ToolChange(moved, sigma, float(moved[worst]), float(sigma[worst]))


@dataclass(frozen=True)
class Drift:
    """All of the comparison."""

    now: Calibration
    then: Calibration
    compared: Compared
    room: Room | None  # None where no error over the workspace can be determined
    tool: ToolChange | None  # the same, or nothing to compare
    warnings: tuple[str, ...]

    @property
    def found(self) -> bool:
        """Whether anything changed by more than chance gives."""
        joint = self.compared.together
        return bool(self.compared.significant) or (joint is not None and joint.significant)


def drift_of(now: Calibration, then: Calibration, known: KnownArm | str) -> Drift:
    """`known`: the arm of `now`. DataError for arms that cannot be compared at all, naming what differs."""
    rig_now = _rig(now)
    rig_then = _rig(then)
    if len(rig_now.arm.joints) != len(rig_then.arm.joints):
        raise DataError(
            f"report: {then.label} is of an arm with {len(rig_then.arm.joints)} joints, this one has "
            f"{len(rig_now.arm.joints)}; give a calibration of the same arm"
        )
    if now.model.arm_model != then.model.arm_model:
        raise DataError(
            f"report: {then.label} is fitted as '{then.model.arm_model}', this one as '{now.model.arm_model}': their "
            "parameters mean different things; identify one of them again with the model of the other (--plan)"
        )
    found = compared(now.model, rig_now, then.model, rig_then)
    doubt = doubt_of(found.changes, now.model, then.model)
    room = None if isinstance(known, str) else room_of(known)
    tool = None
    if room is not None and not isinstance(known, str) and doubt is not None and found.changes:
        tool = tool_change(known, room, found.changes, doubt)
    warnings = (*_other_arm(rig_now, rig_then), *_more_than_noise(now, then))
    return Drift(now, then, found, room, tool, warnings)


def _rig(one: Calibration) -> Rig:
    if one.recording is None:
        return rig_of(one.model, one.label)
    return rig_in_model(one.recording.rig, ArmModel(one.model.arm_model))


def _more_than_noise(now: Calibration, then: Calibration) -> Iterator[str]:
    """Parameters bend to imitate missing physics, and do so differently at other poses."""
    short = [one.label for one in (then, now) if _lacks_physics(one.model)]
    if short:
        yield (
            f"The model of {' and of '.join(short)} leaves more than noise, so its sigmas are too small: measuring at "
            "other poses can alone appear as a drift. Compare sessions of the same poses, or find the missing physics "
            "first (`calibeam diagnose`)."
        )


def _lacks_physics(model: ModelFile) -> bool:
    """By chi-square against the noise as assumed, or by repeated poses."""
    all_of_it, repeats = scatter(model), repeated(model)
    by_spots = (model.repeats or {}).get("lack_of_fit_p")  # of the method for spots alone
    return (
        (all_of_it is not None and all_of_it.alarm is Alarm.ABOVE_STATED)
        or (repeats is not None and repeats.alarm is Alarm.LACK_OF_FIT)
        or (isinstance(by_spots, float) and by_spots < UNLIKELY)
    )


def _other_arm(now: Rig, then: Rig) -> Iterator[str]:
    ours, theirs = now.arm.serial_number, then.arm.serial_number
    if ours is not None and theirs is not None and ours != theirs:
        yield (
            f"These are two arms: serial number {ours} now, {theirs} then. What follows is how they differ, not how "
            "one of them moved."
        )
    elif now.name != then.name:
        yield f"The rig is called {now.name} now and was called {then.name} then: is it the same arm?"
