"""Torques of a simulation brought to agree with a recorded motion: learned from its first part, judged on the rest, as
torque and as a replay in closed loop.
"""

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording import Recording
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.rig import Rig, load_rig
from calibeam.results.diagnosis import SEED, without_samples
from calibeam.simulation.closed_loop import tracked
from calibeam.simulation.described_torques import described_torques
from calibeam.software import SOFTWARE
from calibrate.compare.reconciled_rows import LackingRecord, ReconcileFile
from calibrate.diagnose.motion import (
    JointTorquesRecord,
    MotionReconciled,
    TorqueDiagnosis,
    reconcile_motion,
    torques_of_rig,
    with_torques,
)
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values
from calibrate.model.torque_records import TorquesOfModel
from calibrate.quantities import counted, significant

DESCRIPTIONS = (".xml", ".mjcf", ".urdf")
OTHER_ARM = 0.02  # m, and of the axes of the flange: calibration moves them by less
NOT_BETTER = "no model: on the unseen part of the motion it is no better than the simulation, or than its links alone"


@dataclass(frozen=True, eq=False)
class MotionPart:
    """What a motion adds to a reconciliation; `model` None: it would be no better on the unseen part."""

    file: ReconcileFile
    found: TorqueDiagnosis  # of the first part
    diagnosis: DiagnosisFile  # of it alone
    model: TorquesOfModel | None


def reconcile_torques(
    measured: Recording, simulated: TorquesOfModel | None, name: str
) -> MotionPart | ExaminationRecord:
    """Why the torques are not examined, where they are not. `simulated` None: the simulation states no masses."""
    found = reconcile_motion(measured, simulated, np.random.default_rng(SEED))
    if isinstance(found, ExaminationRecord):
        return found
    joints, why_not = _replayed(measured, found)
    said = found.found.diagnosis
    remains = [f"unexplained at {one.where}: {one.why}" for one in said.unexplained]
    remains += [
        f"torque of joint {one.joint}: {significant(one.after_nm)} Nm are left, {significant(one.noise_nm)} Nm is noise"
        for one in joints
        if not found.agrees and one.after_nm > found.agrees_at * one.noise_nm
    ]
    lacking = tuple(
        LackingRecord(
            f.name.where, f.name.physics, f.says, tuple(f"{r.name.physics} at {r.name.where}" for r in f.rivals)
        )
        for f in said.findings
    )
    notes = (found.found.motion.made, *found.brought.notes, *filter(None, (why_not,)))
    notes = notes if found.better else (*notes, NOT_BETTER)
    file = ReconcileFile(
        schema=1,
        kind="calibeam-reconciliation",
        software=SOFTWARE,
        measured=measured.path.name,
        simulation=name,
        verdict="differ" if remains else "agree",
        says=_says(found, agree=not remains),
        seed=SEED,
        seen=found.found.model.samples,
        unseen_rows=(),
        unseen=(),
        rows=(),
        left_out=lacking,
        remains=tuple(remains),
        next=(),
        notes=notes,
        torques=joints,
    )
    diagnosis = with_torques(without_samples(measured.rig, measured.rig_text), found.found)
    return MotionPart(file, found.found, diagnosis, found.brought if found.better else None)


def torques_stated(simulation: Path, rig: Rig) -> TorquesOfModel | None:
    """What a simulation states of the torques; None where it states no masses, or is a recording."""
    if simulation.suffix == ".toml":
        other = load_rig(simulation)
        _refuse_other_arm(simulation, rig, other)
        return torques_of_rig(other, simulation.name)
    return described_torques(simulation, rig) if simulation.suffix in DESCRIPTIONS else None


def _refuse_other_arm(simulation: Path, rig: Rig, other: Rig) -> None:
    """DataError where the flanges of the two arms are further apart than calibration moves them."""
    same = other.n_joints == rig.n_joints
    if same:
        q_rad = np.outer((0.0, 0.5), np.ones(rig.n_joints))
        mine, theirs = (arm.frames(start_values(arm.parameters), q_rad)[:, -1] for arm in map(arm_of, (rig, other)))
        same = float(np.max(np.abs(mine - theirs))) < OTHER_ARM
    if not same:
        raise DataError(f"{simulation}: another arm than that of the recording; give the rig file of this robot")


def _replayed(measured: Recording, found: MotionReconciled) -> tuple[tuple[JointTorquesRecord, ...], str]:
    """The joints with their tracking, or why there is none."""
    arms = [one for one in (found.simulated, found.links, found.brought) if one is not None]
    tracking, why_not = tracked(measured, arms, found.cut_s)
    if tracking is None:
        return found.joints, why_not
    before, links, after = (None, *tracking) if found.simulated is None else tracking
    joints = tuple(
        msgspec.structs.replace(
            one,
            tracking_before_rad=None if before is None else float(before[one.joint - 1]),
            tracking_links_rad=float(links[one.joint - 1]),
            tracking_after_rad=float(after[one.joint - 1]),
        )
        for one in found.joints
    )
    return joints, ""


def _says(found: MotionReconciled, *, agree: bool) -> str:
    causes = counted(len(found.found.diagnosis.findings), "cause")
    how = "Torques of simulation and recording agree" if agree else "Torques of simulation and recording still differ"
    return f"{how} on the unseen part of the motion with the {causes} found in the part before it."


def with_motion(file: ReconcileFile | None, part: MotionPart | ExaminationRecord) -> ReconcileFile:
    """A reconciliation of poses, of a motion, or of both. ValueError of neither."""
    if isinstance(part, ExaminationRecord):
        if file is None:
            raise ValueError("nothing was reconciled")
        return file
    if file is None:
        return part.file
    more = part.file
    return msgspec.structs.replace(
        file,
        verdict="differ" if more.remains and file.verdict == "agree" else file.verdict,
        says=f"{file.says} {more.says}",
        left_out=(*file.left_out, *more.left_out),
        remains=(*file.remains, *more.remains),
        notes=tuple(dict.fromkeys((*file.notes, *more.notes))),
        torques=more.torques,
    )
