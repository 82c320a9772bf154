"""The arm models by their name in the rig file; a new model is one file beside this one and one line here."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Arm, ArmModel, Rig
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.model.arms.dh import DhArm, DhLink
from calibrate.model.arms.link_tolerance import HELD_AS_DRAWN, LinkBelief
from calibrate.model.arms.local_poe import LocalPoeArm
from calibrate.model.arms.mdh import MdhArm
from calibrate.model.arms.serial import SerialArm
from calibrate.model.rigid import transform

Floats = NDArray[np.float64]


def dh_rows(arm: Arm) -> tuple[DhLink, ...]:
    """The rows of a D-H table of either kind, nominal."""
    return tuple(DhLink(j.theta_offset_rad or 0.0, j.d_m or 0.0, j.a_m or 0.0, j.alpha_rad or 0.0) for j in arm.joints)


def _base(arm: Arm) -> Floats:
    return transform(arm.base.origin_m, arm.base.rotation_rad)


def _dh(arm: Arm, belief: LinkBelief) -> SerialArm:
    return DhArm(dh_rows(arm), belief, transform(arm.flange.origin_m, arm.flange.rotation_rad), _base(arm))


def _mdh(arm: Arm, belief: LinkBelief) -> SerialArm:
    return MdhArm(dh_rows(arm), belief, transform(arm.flange.origin_m, arm.flange.rotation_rad), _base(arm))


def _local_poe(arm: Arm, belief: LinkBelief) -> SerialArm:
    parts = [transform(j.origin_m or (0.0, 0.0, 0.0), j.rotation_rad or (0.0, 0.0, 0.0)) for j in arm.joints]
    return LocalPoeArm(np.array([*parts, transform(arm.flange.origin_m, arm.flange.rotation_rad)]), belief)


ARMS: Mapping[ArmModel, Callable[[Arm, LinkBelief], SerialArm]] = {
    ArmModel.DH: _dh,
    ArmModel.MDH: _mdh,
    ArmModel.LOCAL_POE: _local_poe,
}


def serial_arm(arm: Arm, belief: LinkBelief) -> SerialArm:
    """The arm of any model, its links under the prior given, its readings coupled as declared."""
    return ARMS[arm.model](arm, belief).coupled(by_reading(arm))


def arm_of(rig: Rig, belief: LinkBelief | None = None) -> SerialArm:
    """The rig's arm, its links as `belief` or else the [tolerance] states, else held nominal."""
    return serial_arm(rig.arm, drawn_belief(rig) if belief is None else belief)


def drawn_belief(rig: Rig) -> LinkBelief:
    """What the rig's [tolerance] states; nothing states how far the drawing may be off: it is taken as exact."""
    if rig.tolerance is None:
        return HELD_AS_DRAWN
    return LinkBelief(rig.tolerance.length_m, rig.tolerance.angle_rad)
