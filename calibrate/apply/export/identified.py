"""The arm that is exported: the rig as corrected, ready for every form."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import corrected_parts
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.model.arms.eccentric import COSINE, SINE
from calibrate.model.model_file import Covariance, ModelParameter
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

SIGN = (  # of an arm whose joints count from the link in front
    "joint values are the readings of the controller or the encoders; identified zeros are already inside the numbers"
    " below, nothing is to be added or subtracted"
)

NO_NUMBER = "not determined"


@dataclass(frozen=True)
class AxisOffset:
    """Of a reading: the arm stands as if reading + value were read, in the robot's own signs and couplings."""

    joint: int  # from 1
    value_rad: float
    sigma_rad: float | None  # None: not known
    why: str  # not determined; "" where it is


@dataclass(frozen=True)
class IdentifiedArm:
    """T_base_flange(q) = F_0 Rz(q_1) F_1 ... Rz(q_n) F_n with q the angles from the link in front: the readings, but
    of a joint that follows another one (arms/coupled_readings.py).
    """

    rig: Rig
    corrections: Mapping[str, float]  # of the arm only
    parts: Floats  # (joint + 1, 4, 4) F_0 ... F_n
    tool_m: tuple[float, float, float] | None  # target point in the flange frame, where rig or model names one
    not_carried: tuple[str, ...] = ()  # sentences: what the form cannot hold (not_carried.py)
    zeros: tuple[AxisOffset, ...] = ()
    compliance_rad_nm: Mapping[int, float] = field(default_factory=dict[int, float])  # joint from 1: linear ones
    stated: tuple[ModelParameter, ...] = ()  # what the model holds of each correction
    torques: TorquesOfModel | None = None  # of a model of a motion
    dh_table: tuple[ModelParameter, ...] = ()  # and, of an arm of poses, of those of its standard D-H table

    @property
    def sign(self) -> str:
        """What the joint values of a file are, which has no coupled joints of its own."""
        followers = [
            f"joint {i} = reading {i} {'+' if joint.follows.by > 0.0 else '-'} reading {joint.follows.joint}"
            for i, joint in enumerate(self.rig.arm.joints, start=1)
            if joint.follows is not None
        ]
        if not followers:
            return SIGN
        return (
            f"joint values are physical angles, each from the link in front: {', '.join(followers)}; those of all other"
            " joints are the readings of the controller. Limits are those of the angles over all readings. Identified"
            " zeros are already inside the numbers below, nothing is to be added or subtracted"
        )

    @property
    def limits_rad(self) -> tuple[tuple[float, float], ...]:
        """(lower, upper) of every angle: of a joint that follows, over the ranges of both readings."""
        joints, out = self.rig.arm.joints, list[tuple[float, float]]()
        for joint in joints:
            low, high = joint.lower_rad, joint.upper_rad
            if joint.follows is not None:
                other = joints[joint.follows.joint - 1]
                ends = sorted(joint.follows.by * end for end in (other.lower_rad, other.upper_rad))
                low, high = low + ends[0], high + ends[1]
            out.append((low, high))
        return tuple(out)


def identified_arm(
    rig: Rig,
    corrections: Mapping[str, float],
    tool_about_m: tuple[float, ...] | None = None,
    not_carried: tuple[str, ...] = (),
    stated: Sequence[ModelParameter] | None = None,
    compliance_rad_nm: Mapping[int, float] | None = None,
    covariance: Covariance | None = None,
) -> IdentifiedArm:
    """Takes what belongs to arm and tool point; `tool_about_m` is what a model's corrections of the tool are about,
    else the rig's point. `stated`: what the model holds of each correction; None: nothing beside its value.
    `covariance`: of these; without it, zeros count as independent of each other.

    DataError for a joint or link that this arm does not have.
    """
    known = {p.name for p in arm_of(rig).parameters}
    discs = [name for name, value in corrections.items() if name.endswith((SINE, COSINE)) and value != 0.0]
    if discs:
        raise DataError(
            f"rig {rig.name}: {discs[0]} is not zero, and no other program's arm knows of encoder discs off their"
            ' shafts; identify with hold = ["joint*.disc_*"], or predict with calibeam'
        )
    for name in corrections:
        if name.startswith(("joint", "link")) and name not in known:
            raise DataError(
                f"rig {rig.name}: no parameter {name} in an arm of model '{rig.arm.model.value}' with {rig.n_joints}"
                " joints; give the model.json that was identified with this rig"
            )
    own = {k: v for k, v in corrections.items() if k in known}
    tool_m = _tool_m(rig.tool.point_m if tool_about_m is None else tool_about_m[:3], corrections)
    zeros = _of_readings(rig, tuple(_zero(i, own, stated) for i in range(1, rig.n_joints + 1)), covariance)
    parts, yields = corrected_parts(rig.arm, own), dict(compliance_rad_nm or {})
    return IdentifiedArm(rig, own, parts, tool_m, not_carried, zeros, yields, tuple(stated or ()))


def _zero(joint: int, own: Mapping[str, float], stated: Sequence[ModelParameter] | None) -> AxisOffset:
    """A zero of which the model has no number was held where it is, or is one choice among many."""
    name = f"joint{joint}.zero"
    if stated is None:
        return AxisOffset(joint, own.get(name, 0.0), None, "" if name in own else NO_NUMBER)
    found = next((p for p in stated if p.name == name), None)
    if found is None or found.value is None:
        why = None if found is None else found.undetermined
        return AxisOffset(joint, own.get(name, 0.0), None, why or NO_NUMBER)
    return AxisOffset(joint, found.value, found.sigma, "")


def _of_readings(rig: Rig, zeros: tuple[AxisOffset, ...], covariance: Covariance | None) -> tuple[AxisOffset, ...]:
    """Offsets of the readings for zeros of the angles: with angle 3 = reading 3 + reading 2, zero 3 less zero 2."""
    matrix = by_reading(rig.arm)
    if matrix is None:
        return zeros
    back = np.linalg.inv(matrix)
    value = back @ np.array([zero.value_rad for zero in zeros])
    C = _covariance(zeros, covariance)
    variance = np.diag(back @ C @ back.T)
    out: list[AxisOffset] = []
    for i, zero in enumerate(zeros):
        of = [other for other, share in zip(zeros, back[i], strict=True) if share != 0.0]
        known = all(other.sigma_rad is not None for other in of)
        sigma = float(np.sqrt(variance[i])) if known else None
        why = next((other.why for other in of if other.why), "")
        out.append(AxisOffset(zero.joint, float(value[i]), sigma, why))
    return tuple(out)


def _covariance(zeros: tuple[AxisOffset, ...], held: Covariance | None) -> Floats:
    """(joint, joint) of the zeros; independent where the model holds no covariance of them."""
    out = np.diag([(zero.sigma_rad or 0.0) ** 2 for zero in zeros])
    place = {} if held is None else {name: i for i, name in enumerate(held.names)}
    for a, one in enumerate(zeros):
        for b, other in enumerate(zeros):
            i, j = (place.get(f"joint{zero.joint}.zero") for zero in (one, other))
            if held is not None and a != b and i is not None and j is not None:
                out[a, b] = held.rows[i][j]
    return out


def _tool_m(about_m: tuple[float, ...] | None, corrections: Mapping[str, float]) -> tuple[float, float, float] | None:
    if about_m is None:
        return None
    x, y, z = (v + corrections.get(f"tool.{a}", 0.0) for a, v in zip("xyz", about_m, strict=True))
    return x, y, z


def roll_pitch_yaw(rotation: Floats) -> tuple[float, float, float]:
    """Angles of R = Rz(yaw) Ry(pitch) Rx(roll), the fixed-axis angles of URDF (Craig 2005, eq. 2.64).

    Roll is read after yaw and pitch are taken away, so that the three together stay exact where roll and yaw alone are
    undefined (pitch of a quarter turn), which is the rule and not the exception in an arm CMM.
    """
    yaw = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
    c, s = np.cos(yaw), np.sin(yaw)
    along, across = c * rotation[0] + s * rotation[1], c * rotation[1] - s * rotation[0]  # rows of Rz(-yaw) R
    pitch = float(np.arctan2(-rotation[2, 0], along[0]))
    return float(np.arctan2(-across[2], across[1])), pitch, yaw
