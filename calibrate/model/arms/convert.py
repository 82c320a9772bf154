"""One arm model into another one, with the error that the conversion leaves.

What was identified is put into the numbers of the new model: its nominal is the old arm as corrected. Only tilts,
for which the rig file has no key, stay corrections. docs/decisions/0004 states which conversions are exact.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Arm, ArmModel, Joint, Pose
from calibrate.model.arms.catalogue import ARMS
from calibrate.model.arms.coupled_readings import by_reading, uncoupled
from calibrate.model.arms.dh import DhLink
from calibrate.model.arms.link_tolerance import HELD_NOMINAL
from calibrate.model.arms.serial import (
    chain_frames,
    rotation_x,
    rotation_z,
    shift,
)
from calibrate.model.arms.table import NearParallel, Table, dh_table
from calibrate.model.parameters import values_by_name
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]

SAMPLED_POSES = 200
SEED = 4  # of the sampled poses, so that a conversion reports the same error twice


@dataclass(frozen=True)
class ErrorLeft:
    """Flange of the new arm against the old one over poses drawn evenly between the joint limits."""

    position_max_m: float
    position_rms_m: float
    angle_max_rad: float
    angle_rms_rad: float


@dataclass(frozen=True)
class Conversion:
    """The new arm. Its base frame may have to stand elsewhere: the first axis of a D-H table is z of its base."""

    arm: Arm
    corrections: Mapping[str, float]  # tilts, by parameter name
    T_base_new: Floats  # the new arm's base in the old one's
    error: ErrorLeft


def convert(
    arm: Arm,
    model: ArmModel,
    corrections: Mapping[str, float] | None = None,
    near_parallel: NearParallel = NearParallel.TILT,
) -> Conversion:
    """The arm as corrected in another model. KeyError for a correction that the arm does not have.

    The first frame and the senses of common normals of a corrected arm are those of the nominal one, so that the
    numbers of both compare.
    """
    parts = corrected_parts(arm, corrections or {})
    if model is ArmModel.LOCAL_POE:
        new, tilts, T_base_new = _local_poe(arm, parts), dict[str, float](), np.eye(4)
    else:
        like = dh_table(_offsets_behind(arm, {}, corrected_parts(arm, {})), near_parallel) if corrections else None
        table = dh_table(_offsets_behind(arm, corrections or {}, parts), near_parallel, like)
        new = _standard(arm, table) if model is ArmModel.DH else _modified(arm, table)
        tilts = {f"link{i}.tilt": t for i, t in enumerate(table.tilt_rad, start=1) if t != 0.0}
        T_base_new = table.T_base_first
    return Conversion(new, tilts, T_base_new, _error_left(arm, parts, corrected_parts(new, tilts), T_base_new))


def corrected_parts(arm: Arm, corrections: Mapping[str, float]) -> Floats:
    """(joint + 1, 4, 4) F_0 ... F_n of the arm as corrected, joint offsets and zeros turned into them.

    KeyError for a correction that the arm does not have.
    """
    built = ARMS[arm.model](arm, HELD_NOMINAL)
    theta = values_by_name(built.parameters, corrections)
    parts = built.fixed_parts(theta)
    parts[:-1] = parts[:-1] @ rotation_z(built.angle_offset_rad(theta))
    return parts


def _offsets_behind(arm: Arm, corrections: Mapping[str, float], parts: Floats) -> Floats:
    """Parts with each offset d of a modified table behind its turn: along parallel axes d stays with its joint."""
    if arm.model is not ArmModel.MDH:
        return parts
    d = np.array([j.d_m or 0.0 for j in arm.joints])
    d += [corrections.get(f"link{i}.offset", 0.0) for i in range(1, len(d) + 1)]
    out = parts.copy()
    out[:-1] = out[:-1] @ shift(np.zeros_like(d), -d)
    out[1:] = shift(np.zeros_like(d), d) @ out[1:]
    return out


def flange_of_parts(parts: Floats, q_rad: Floats) -> Floats:
    """(pose, 4, 4) of F_0 Rz(q_1) F_1 ... F_n at turns of the joints (pose, joint)."""
    return chain_frames(parts[0], parts[1:], q_rad)[:, -1]


def sampled_readings(arm: Arm, n: int = SAMPLED_POSES) -> Floats:
    """(pose, joint) joint readings drawn evenly between the limits, the same at every call."""
    lower, upper = [j.lower_rad for j in arm.joints], [j.upper_rad for j in arm.joints]
    return np.random.default_rng(SEED).uniform(lower, upper, (n, len(arm.joints)))


def pose_of(T: Floats) -> Pose:
    """The rig file's record of a transform."""
    return Pose(_vector(T[:3, 3]), _vector(Rotation.from_matrix(T[:3, :3]).as_rotvec()))


def _local_poe(arm: Arm, parts: Floats) -> Arm:
    poses = [pose_of(part) for part in parts]
    joints = tuple(
        replace(_bare(j), origin_m=p.origin_m, rotation_rad=p.rotation_rad)
        for j, p in zip(arm.joints, poses[:-1], strict=True)
    )
    return Arm(ArmModel.LOCAL_POE, joints, arm.gravity_m_s2, poses[-1])


def _standard(arm: Arm, table: Table) -> Arm:
    joints = tuple(_dh_joint(j, row) for j, row in zip(arm.joints, table.rows, strict=True))
    return Arm(ArmModel.DH, joints, _gravity(arm, table), pose_of(table.T_last_flange))


def _modified(arm: Arm, table: Table) -> Arm:
    """Length and twist move one row down; those of the last row go into the flange (Craig 2005, ch. 3.4)."""
    before = (DhLink(0.0, 0.0, 0.0, 0.0), *table.rows[:-1])
    rows = [DhLink(r.theta_offset_rad, r.d_m, b.a_m, b.alpha_rad) for r, b in zip(table.rows, before, strict=True)]
    last = table.rows[-1]
    end = shift(last.a_m, 0.0) @ rotation_x(last.alpha_rad)
    joints = tuple(_dh_joint(j, row) for j, row in zip(arm.joints, rows, strict=True))
    return Arm(ArmModel.MDH, joints, _gravity(arm, table), pose_of(end @ table.T_last_flange))


def _dh_joint(joint: Joint, row: DhLink) -> Joint:
    return replace(
        _bare(joint), a_m=row.a_m, alpha_rad=row.alpha_rad, d_m=row.d_m, theta_offset_rad=row.theta_offset_rad
    )


def _bare(joint: Joint) -> Joint:
    """The joint without its fixed part; mass stays, its centre does not: the link frame is another one."""
    return Joint(
        joint.lower_rad,
        joint.upper_rad,
        gear_ratio=joint.gear_ratio,
        encoder_counts=joint.encoder_counts,
        mass_kg=joint.mass_kg,
        follows=joint.follows,
    )


def _gravity(arm: Arm, table: Table) -> tuple[float, float, float]:
    """Gravity in the new base frame."""
    return _vector(table.T_base_first[:3, :3].T @ np.array(arm.gravity_m_s2))


def _vector(values: Floats) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _error_left(arm: Arm, old: Floats, new: Floats, T_base_new: Floats) -> ErrorLeft:
    q = uncoupled(by_reading(arm), sampled_readings(arm))
    T_old, T_new = flange_of_parts(old, q), T_base_new @ flange_of_parts(new, q)
    position = np.linalg.norm(T_new[:, :3, 3] - T_old[:, :3, 3], axis=1)
    angle = Rotation.from_matrix((inverse(T_old) @ T_new)[:, :3, :3]).magnitude()
    return ErrorLeft(_max(position), _rms(position), _max(angle), _rms(angle))


def _max(values: Floats) -> float:
    return float(np.max(values))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
