"""A simulation brought to agree with a recorded motion: learned from its first part, judged on the rest of it."""

from dataclasses import dataclass, fields, replace

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.examination import ExaminationRecord
from calibrate.diagnose.motion.links_alone import expected_nm
from calibrate.diagnose.motion.motion_table import Motion, motion_of
from calibrate.diagnose.motion.to_model import torques_of_model, torques_of_state
from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_motion
from calibrate.errors import DataError
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

SEEN = 0.7  # of the moments, the first ones
AGREES = 1.3  # times the noise, as at poses


class JointTorquesRecord(msgspec.Struct, frozen=True):
    """Measured less expected torque of one joint on the unseen part of a motion, Nm rms."""

    joint: int
    moments: int
    torque_nm: float
    before_nm: float | None  # null: the simulation states no masses
    links_nm: float  # with links and rotors fitted
    after_nm: float  # and with the physics
    noise_nm: float
    tracking_before_rad: float | None = None  # of a replay in closed loop, see docs/reconcile.md
    tracking_links_rad: float | None = None
    tracking_after_rad: float | None = None


@dataclass(frozen=True, eq=False)
class MotionReconciled:
    """`simulated` None: the simulation states no masses."""

    found: TorqueDiagnosis  # of the seen part
    simulated: TorquesOfModel | None
    links: TorquesOfModel  # fitted alone
    brought: TorquesOfModel  # with the physics
    cut_s: float  # unseen from here on, clock of the joints
    joints: tuple[JointTorquesRecord, ...]

    @property
    def better(self) -> bool:
        """The physics brought the unseen part nearer than the simulation, and than links and rotors fitted alone."""
        before = [one.links_nm if one.before_nm is None else min(one.before_nm, one.links_nm) for one in self.joints]
        return _over_noise(self.joints, [one.after_nm for one in self.joints]) < _over_noise(self.joints, before)

    @property
    def agrees_at(self) -> float:
        """Times the noise, up to which nothing is left."""
        return AGREES

    @property
    def agrees(self) -> bool:
        """What is left is noise, all joints together."""
        return _over_noise(self.joints, [one.after_nm for one in self.joints]) < AGREES**2


def _over_noise(joints: tuple[JointTorquesRecord, ...], left_nm: list[float]) -> float:
    return float(np.mean([(left / one.noise_nm) ** 2 for one, left in zip(joints, left_nm, strict=True)]))


def reconcile_motion(
    recording: Recording, simulated: TorquesOfModel | None, rng: Generator
) -> MotionReconciled | ExaminationRecord:
    """Why the torques of the recording are not examined, where they are not."""
    motion = motion_of(recording)
    if isinstance(motion, ExaminationRecord):
        return motion
    seen, unseen = motion_in_two(motion)
    if not np.isfinite(unseen.torque_nm).any():
        raise DataError(f"{recording.path}: no joint moves in the last part of the motion, by which a model is judged")
    rig, source = recording.rig, recording.path.name
    found = diagnose_motion(rig, seen, rng, simulated)
    links, brought = torques_of_state(found.bare, source, known=simulated), torques_of_model(found, source)
    before = None if simulated is None else expected_nm(rig, unseen, simulated)
    alone, after = (expected_nm(rig, unseen, one) for one in (links, brought))
    noise = found.model.noise_nm
    joints = tuple(
        JointTorquesRecord(
            j + 1,
            int(np.isfinite(unseen.torque_nm[:, j]).sum()),
            _rms(unseen.torque_nm[:, j]),
            None if before is None else _rms((unseen.torque_nm - before)[:, j]),
            _rms((unseen.torque_nm - alone)[:, j]),
            _rms((unseen.torque_nm - after)[:, j]),
            float(noise[j]),
        )
        for j in range(rig.n_joints)
        if np.isfinite(unseen.torque_nm[:, j]).any()
    )
    return MotionReconciled(found, simulated, links, brought, float(unseen.time_s[0]), joints)


def motion_in_two(motion: Motion) -> tuple[Motion, Motion]:
    """Its seen and its unseen part."""
    cut = round(SEEN * len(motion.time_s))
    return _part(motion, slice(None, cut)), _part(motion, slice(cut, None))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def _part(motion: Motion, rows: slice) -> Motion:
    """Some of the moments."""
    n = len(motion.time_s)
    each = ((field.name, getattr(motion, field.name)) for field in fields(motion))
    cut = {name: value[rows] for name, value in each if isinstance(value, np.ndarray) and len(value) == n}
    return replace(motion, **cut, samples=replace(motion.samples, rows=motion.samples.rows[rows]))
