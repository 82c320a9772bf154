"""The arm models by their name in the rig file; a new model is one file beside this one and one line here."""

from collections.abc import Callable, Mapping

from acquisition.recording.rig_schema import Arm, ArmModel, Rig, Tolerance
from calibrate.arms.dh import DhArm, DhLink
from calibrate.arms.model import KinematicModel
from calibrate.errors import DataError
from calibrate.rigid import transform


def _dh(arm: Arm, tolerance: Tolerance | None) -> KinematicModel:
    links = tuple(DhLink(j.theta_offset_rad or 0.0, j.d_m or 0.0, j.a_m or 0.0, j.alpha_rad or 0.0) for j in arm.joints)
    T_last_flange = transform(arm.flange.origin_m, arm.flange.rotation_rad)
    if tolerance is None:  # nobody says how far the drawing may be off: it is taken as exact, and the report says so
        return DhArm(links, 0.0, 0.0, T_last_flange)
    return DhArm(links, tolerance.length_m, tolerance.angle_rad, T_last_flange)


ARMS: Mapping[ArmModel, Callable[[Arm, Tolerance | None], KinematicModel]] = {ArmModel.DH: _dh}


def arm_of(rig: Rig) -> KinematicModel:
    """The rig's arm as believed. DataError for a model that cannot be fitted yet."""
    build = ARMS.get(rig.arm.model)
    if build is None:
        known = ", ".join(m.value for m in ARMS)
        raise DataError(f"rig {rig.name}: arm.model '{rig.arm.model.value}' cannot be identified; known: {known}")
    return build(rig.arm, rig.tolerance)
