"""The arm that is exported: the rig as corrected, ready for every form."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.arms.convert import corrected_parts
from calibrate.arms.eccentric import COSINE, SINE
from calibrate.errors import DataError
from calibrate.model_file import ModelParameter

Floats = NDArray[np.float64]

SIGN = (
    "joint values are the readings of the controller or the encoders; identified zeros are already inside the numbers"
    " below, nothing is to be added or subtracted"
)


@dataclass(frozen=True)
class AxisOffset:
    """True angle = reading + value."""

    joint: int  # from 1
    value_rad: float
    sigma_rad: float | None  # None: not known
    undetermined: bool


@dataclass(frozen=True)
class IdentifiedArm:
    """T_base_flange(q) = F_0 Rz(q_1) F_1 ... Rz(q_n) F_n with q the joint readings."""

    rig: Rig
    corrections: Mapping[str, float]  # of the arm only
    parts: Floats  # (joint + 1, 4, 4) F_0 ... F_n
    tool_m: tuple[float, float, float] | None  # target point in the flange frame, where rig or model names one
    not_carried: tuple[str, ...] = ()  # sentences: what the form cannot hold (not_carried.py)
    zeros: tuple[AxisOffset, ...] = ()
    compliance_rad_nm: Mapping[int, float] = field(default_factory=dict[int, float])  # joint from 1: linear ones


def identified_arm(
    rig: Rig,
    corrections: Mapping[str, float],
    tool_about_m: tuple[float, ...] | None = None,
    not_carried: tuple[str, ...] = (),
    stated: Sequence[ModelParameter] | None = None,
    compliance_rad_nm: Mapping[int, float] | None = None,
) -> IdentifiedArm:
    """Takes what belongs to arm and tool point; `tool_about_m` is what a model's corrections of the tool are about,
    else the rig's point. `stated`: what the model holds of each correction; None: nothing beside its value.

    DataError for a joint or link that this arm does not have.
    """
    followers = [i for i, joint in enumerate(rig.arm.joints, start=1) if joint.follows is not None]
    if followers:
        raise DataError(
            f"rig {rig.name}: joint {followers[0]} follows another joint, and this form has no coupled joints; give the"
            " program that needs the arm angles from the links in front, and a rig without 'follows'"
        )
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
    zeros = tuple(_zero(i, own, stated) for i in range(1, rig.n_joints + 1))
    parts, yields = corrected_parts(rig.arm, own), dict(compliance_rad_nm or {})
    return IdentifiedArm(rig, own, parts, tool_m, not_carried, zeros, yields)


def _zero(joint: int, own: Mapping[str, float], stated: Sequence[ModelParameter] | None) -> AxisOffset:
    """A zero of which the model has no number was held where it is, or is one choice among many."""
    name = f"joint{joint}.zero"
    if stated is None:
        return AxisOffset(joint, own.get(name, 0.0), None, name not in own)
    found = next((p for p in stated if p.name == name), None)
    if found is None or found.value is None:
        return AxisOffset(joint, own.get(name, 0.0), None, True)
    return AxisOffset(joint, found.value, found.sigma, False)


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
