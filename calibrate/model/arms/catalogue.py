"""The arm models by their name in the rig file; a new model is one file beside this one and one line here."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Arm, ArmModel, Rig
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.model.arms.dh import DhArm, DhLink
from calibrate.model.arms.link_tolerance import HELD_NOMINAL, LinkTolerance
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


def _dh(arm: Arm, tolerance: LinkTolerance) -> SerialArm:
    return DhArm(dh_rows(arm), tolerance, transform(arm.flange.origin_m, arm.flange.rotation_rad), _base(arm))


def _mdh(arm: Arm, tolerance: LinkTolerance) -> SerialArm:
    return MdhArm(dh_rows(arm), tolerance, transform(arm.flange.origin_m, arm.flange.rotation_rad), _base(arm))


def _local_poe(arm: Arm, tolerance: LinkTolerance) -> SerialArm:
    parts = [transform(j.origin_m or (0.0, 0.0, 0.0), j.rotation_rad or (0.0, 0.0, 0.0)) for j in arm.joints]
    return LocalPoeArm(np.array([*parts, transform(arm.flange.origin_m, arm.flange.rotation_rad)]), tolerance)


ARMS: Mapping[ArmModel, Callable[[Arm, LinkTolerance], SerialArm]] = {
    ArmModel.DH: _dh,
    ArmModel.MDH: _mdh,
    ArmModel.LOCAL_POE: _local_poe,
}


def serial_arm(arm: Arm, tolerance: LinkTolerance) -> SerialArm:
    """The arm of any model, its links under the prior given, its readings coupled as declared."""
    return ARMS[arm.model](arm, tolerance).coupled(by_reading(arm))


def arm_of(rig: Rig, tolerance: LinkTolerance | None = None) -> SerialArm:
    """The rig's arm, its links as `tolerance` or else the [tolerance] states, else held nominal."""
    return serial_arm(rig.arm, nominal_tolerance(rig) if tolerance is None else tolerance)


def nominal_tolerance(rig: Rig) -> LinkTolerance:
    """What the rig's [tolerance] states; nothing states how far the drawing may be off: it is taken as exact."""
    if rig.tolerance is None:
        return HELD_NOMINAL
    return LinkTolerance(rig.tolerance.length_m, rig.tolerance.angle_rad)
