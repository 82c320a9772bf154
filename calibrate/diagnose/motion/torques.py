"""From a recorded motion to which torque was left out: the search of poses at the torques of the joints, and its record
in diagnosis.json.
"""

import math
from dataclasses import dataclass

import numpy as np
from msgspec import structs
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import Rig
from calibrate.diagnose.assess.diagnosis import Diagnosis, Verdict
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.motion.motion_table import Motion, motion_of
from calibrate.diagnose.motion.torque_problem import TorqueProblem, link_parameters
from calibrate.diagnose.motion.torque_state import TorqueState, with_torque
from calibrate.diagnose.record.schema import TORQUE, DiagnosisFile, JointTorqueRecord, TorquesRecord
from calibrate.diagnose.record.to_file import finding_record, unexplained_record
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.model.arms.inverse_dynamics import torque_columns
from calibrate.model.arms.serial import SerialArm
from calibrate.model.effects.term import Accepted, Missing
from calibrate.model.effects.torque import TORQUES, MotionDrivers, friction
from calibrate.model.parameters import start_values
from calibrate.model.rigid import cross_matrix

Floats = NDArray[np.float64]

RATE_STEP_S = 1e-4  # of the difference quotient by time
JUDGED = "last block"  # the split that a motion is judged by: single moments are half known by their neighbours


@dataclass(frozen=True, eq=False)
class TorqueDiagnosis:
    """What a motion shows; `bare` with the links alone, `model` with the terms of the findings."""

    motion: Motion
    diagnosis: Diagnosis
    bare: TorqueState

    @property
    def model(self) -> TorqueState:
        found = self.diagnosis.model
        if not isinstance(found, TorqueState):
            raise TypeError(f"a diagnosis of {type(found).__name__}, which is no fit to torques")
        return found


def diagnose_torques(recording: Recording, rng: Generator) -> TorqueDiagnosis | None:
    """None where the recording holds no torques beside joint angles, or too few of them in motion; and of an arm with a
    joint that follows another one.
    """
    coupled = by_reading(recording.rig.arm) is not None  # torques of such drives are shared out between two joints
    motion = None if coupled else motion_of(recording)
    if motion is None:
        return None
    bare = torque_state(recording.rig, motion)
    missing: tuple[Missing, ...] = tuple(m for kind in TORQUES for m in kind.missing(bare.drivers))
    return TorqueDiagnosis(motion, diagnose(bare, rng, missing, usual=usual_friction(bare)), bare)


def usual_friction(bare: TorqueState) -> tuple[Accepted, ...]:
    """Dry and viscous friction of every joint: a drive without any is the exception, and links alone that have to stand
    for it are no place to begin a search from.
    """
    terms = [term for kind in (friction.COULOMB, friction.VISCOUS) for term in kind.terms(bare.drivers)]
    return tuple(Accepted(term, np.zeros(1), np.zeros(0)) for term in terms)


def torque_state(rig: Rig, motion: Motion) -> TorqueState:
    """The links alone, fitted."""
    drivers = motion_drivers(rig, motion)
    links = link_parameters(rig)
    moment, joint = (part.astype(np.intp) for part in np.nonzero(np.isfinite(motion.torque_nm)))
    order = np.lexsort((moment, joint))
    moment, joint = moment[order], joint[order]
    observed = motion.torque_nm[moment, joint]
    columns = drivers.link_columns.reshape(*motion.q_rad.shape, -1)[moment, joint]
    spread = np.array(
        [max(float(np.std(observed[joint == j])), 1e-9) if np.any(joint == j) else 1.0 for j in range(rig.n_joints)]
    )
    whole = TorqueProblem(
        links,
        columns,
        observed,
        moment,
        joint,
        spread,
        np.full(rig.n_joints, 1e-3),
        np.ones(len(moment)),
        (),
        (),
        drivers,
    )
    start, everything = start_values(links), np.arange(len(motion.time_s))
    first = TorqueState(whole, everything, whole, start, np.inf)
    return first.refitted(()).renewed()


def motion_drivers(rig: Rig, motion: Motion) -> MotionDrivers:
    """What the terms of the catalogue depend on, and the columns of the links; its torque that of the stated links."""
    arm = arm_of(rig)
    frames = arm.frames(start_values(arm.parameters), motion.q_rad)
    qd, qdd, none = motion.qd_rad_s, motion.qdd_rad_s2, np.zeros_like(motion.qd_rad_s)
    columns, of_rate, of_lean = _link_columns(arm, frames, motion, np.array(rig.arm.gravity_m_s2))
    each, heat = range(1, rig.n_joints + 1), motion.temperature_degC
    plain = MotionDrivers(
        rig=rig,
        q_rad=motion.q_rad,
        t_s=motion.time_s,
        frames=frames,
        readouts={},
        approach=None,
        approach_derived=False,
        last_move_rad=none,
        qd_rad_s=qd,
        cmd_minus_q_rad=None,
        temperatures_degC={} if heat is None else {f"joint{i}": heat[:, i - 1] for i in each},
        payload_kg=None,
        payload_com_m=None,
        psd_sum_v=None,
        extra={f"qdd{i}": qdd[:, i - 1] for i in each},
        repeat=None,
        qd=qd,
        qdd_rad_s2=qdd,
        torque_nm=none,
        torque_rate_nm_s=none,
        link_columns=_with_rotors(columns, qdd),
        rate_columns=_with_rotors(of_rate, motion.jerk_rad_s3),
        lean_columns=_with_rotors(of_lean, none),
        last_link=columns[:, :, -1, :4],
        tilted=np.zeros((*qd.shape, 2)),
        still_rad_s=motion.still_rad_s,
        temperature_degC=heat,
    )
    return with_torque(plain, start_values(link_parameters(rig)))


def _link_columns(arm: SerialArm, frames: Floats, motion: Motion, gravity: Floats) -> tuple[Floats, Floats, Floats]:
    """(moment, joint, link, 10) torques, their derivative by time, and (moment, joint, 2, link, 10) by a lean."""
    q, qd, qdd, jerk = motion.q_rad, motion.qd_rad_s, motion.qdd_rad_s2, motion.jerk_rad_s3
    theta, still = start_values(arm.parameters), np.zeros_like(qd)
    ahead, back = (
        torque_columns(arm.frames(theta, q + h * qd), qd + h * qdd, qdd + h * jerk, gravity)
        for h in (RATE_STEP_S, -RATE_STEP_S)
    )
    lean = [torque_columns(frames, still, still, cross_matrix(axis) @ gravity) for axis in np.eye(3)[:2]]
    columns = torque_columns(frames, qd, qdd, gravity)
    return columns, (ahead - back) / (2.0 * RATE_STEP_S), np.stack(lean, axis=2)


def _with_rotors(links: Floats, by_rotor: Floats) -> Floats:
    """(torque, link number) of links (moment, joint, ..., link, 10); each rotor turns its own joint (moment, joint)."""
    n = by_rotor.shape[1]
    own = by_rotor[:, :, None] * np.eye(n)
    own = own if links.ndim == 4 else np.repeat(own[:, :, None], links.shape[2], axis=2)
    return np.concatenate([links.reshape(own.size // n, -1), own.reshape(-1, n)], axis=1)


def with_torques(file: DiagnosisFile, found: TorqueDiagnosis | None) -> DiagnosisFile:
    """The diagnosis with what the torques show; findings of samples and streams stay in front."""
    if found is None:
        return file
    said = found.diagnosis
    findings = tuple(structs.replace(finding_record(one, None), stream=TORQUE, curve=None) for one in said.findings)
    left = tuple(unexplained_record(one, None) for one in said.unexplained)
    first = left[0] if left and file.unexplained is None else file.unexplained
    verdict = said.verdict.value
    if file.samples or file.verdict == Verdict.MISMATCH.value or verdict == Verdict.CONSISTENT.value:
        verdict = file.verdict  # what a drive takes is no fault of settled poses
    return structs.replace(
        file,
        verdict=verdict,
        findings=file.findings + findings,
        unexplained=first,
        also_unexplained=(*file.also_unexplained, *(one for one in left if one is not first)),
        next=(*_to_record(said), *file.next),
        torques=TorquesRecord(found.motion.made, tuple(_joints(found))),
    )


def _to_record(said: Diagnosis) -> tuple[str, ...]:
    """Motions in the place of poses: what separates alternatives of friction is speed."""
    shared = [f"{f.name.physics} at {f.name.where}" for f in said.findings if f.rivals]
    columns = tuple(
        dict.fromkeys(f"record {m.column}: without it {m.physics} cannot be determined" for m in said.missing)
    )
    if not shared:
        return columns
    return (*columns, f"{', '.join(shared)} could also be another cause: record the motion slower and faster, too")


def _joints(found: TorqueDiagnosis) -> list[JointTorqueRecord]:
    proofs = {one.instrument: one for one in found.diagnosis.proofs if one.split == JUDGED}
    out: list[JointTorqueRecord] = []
    for j in range(found.motion.torque_nm.shape[1]):
        torque = found.motion.torque_nm[:, j]
        proof = proofs.get(f"joint{j + 1}.torque")
        if not np.isfinite(torque).any():
            continue
        out.append(
            JointTorqueRecord(
                joint=j + 1,
                moments=int(np.isfinite(torque).sum()),
                torque_nm=float(np.sqrt(np.nanmean(torque**2))),
                noise_nm=float(found.model.problem.sigma_nm[j]),
                unseen_before_nm=None if proof is None else _number(proof.rms_before_m),
                unseen_after_nm=None if proof is None else _number(proof.rms_after_m),
            )
        )
    return out


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
