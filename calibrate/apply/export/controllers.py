"""Forms that controllers take: joint offsets of KUKA, ABB and FANUC; kinematics YAML and lists of Universal Robots.

Offsets are for the zero positions: the mastering of KUKA, the motor offsets of ABB, the mastering of FANUC. One meaning
in all of them: the true angle of an axis is its reading plus its offset, in the signs of the robot. When an offset has
been entered and the arm has not moved, the reading has changed by just that. Sources, where numbers are entered and
what could not be tried: docs/controllers.

YAML: ur_description, config/<type>/default_kinematics.yaml: origins of the six joints in front of their turn, as in
URDF, the first one in base_link_inertia, which is the base of the controller. Lists: calibration.conf, section
[mounting], delta_theta, delta_a, delta_d, delta_alpha added to the published D-H table; four numbers a joint and no
tilt, so that delta_d of the parallel axes runs to metres (forum.universal-robots.com, 18921, shows one). The hash of
the YAML and the checksums of the .conf are computed by the controller and cannot be produced here.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import ArmModel, Rig
from calibrate.apply.export.dh_table import dh_numbers
from calibrate.apply.export.identified import NO_NUMBER, SIGN, AxisOffset, IdentifiedArm, roll_pitch_yaw
from calibrate.apply.export.nominal_table import quoted, to_sigma
from calibrate.errors import DataError
from calibrate.model.arms.convert import (
    Conversion,
    convert,
    corrected_parts,
    pose_of,
)
from calibrate.model.arms.table import NearParallel
from calibrate.model.rigid import inverse

NO_RATIO = "no gear_ratio in the rig file"
CLEAR = 2.0  # sigmas: an offset that is less than this is no better than none
EXPLAINED = (
    "true angle = reading + offset, in the robot's own signs",
    "when it is entered correctly, the reading of an axis at rest changes by its offset; empty: do not enter one",
)
KUKA = "KUKA mastering: add offset_deg to $MAMES of the axis, then master it"
FANUC = "FANUC mastering: a joint that reads r stands at r + offset_deg, which single-axis mastering is to be given"
ABB = "ABB motor calibration: motor_rad, by which the offset of a motor changes that turns in the sense of its axis"


def kuka_mastering_text(arm: IdentifiedArm) -> str:
    """Degrees of A1 ... An, to be added to $MAMES before the axis is mastered at its mark."""
    return _table(arm, KUKA, "A", (("offset_deg", _degrees),))


def fanuc_mastering_text(arm: IdentifiedArm) -> str:
    """Degrees of J1 ... Jn; master counts need pulses per degree, which the rig file does not hold."""
    return _table(arm, FANUC, "J", (("offset_deg", _degrees),))


def abb_moc_text(arm: IdentifiedArm) -> str:
    """Degrees and motor radians, these empty for axes without a gear ratio."""
    ratios = {i: joint.gear_ratio for i, joint in enumerate(arm.rig.arm.joints, start=1)}
    return _table(arm, ABB, "rob1_", (("offset_deg", _degrees), ("motor_rad", lambda joint: ratios[joint])))


def without_ratio(rig: Rig) -> tuple[str, ...]:
    """Which axes have no motor angles, and what to do about it; nothing where every joint has its ratio."""
    missing = [str(i) for i, joint in enumerate(rig.arm.joints, start=1) if joint.gear_ratio is None]
    says = (
        f"motor_rad is empty for axes {', '.join(missing)}: rig {rig.name} has no gear_ratio for them; take the "
        "transmission of each axis from the controller's moc.cfg, state its size as gear_ratio in [[arm.joint]], and "
        "identify again"
    )
    return (says,) if missing else ()


def _table(
    arm: IdentifiedArm, title: str, axis: str, columns: tuple[tuple[str, Callable[[int], float | None]], ...]
) -> str:
    lines = [f"# {says}" for says in (title, *EXPLAINED, *arm.not_carried)]
    lines.append(",".join(("axis", *(name for name, _ in columns), "sigma_deg", "not_entered_because")))
    for zero in arm.zeros:
        why, sigma = refused(zero), zero.sigma_rad
        scales = [scale(zero.joint) for _, scale in columns]
        numbers = ["" if why or k is None else to_sigma(k * zero.value_rad, sigma and k * sigma) for k in scales]
        why = why or (NO_RATIO if None in scales else "")
        sigma_deg = None if sigma is None else math.degrees(sigma)
        lines.append(",".join((f"{axis}{zero.joint}", *numbers, to_sigma(sigma_deg, sigma_deg), quoted(why))))
    return "\n".join(lines) + "\n"


def refused(zero: AxisOffset) -> str:
    """Why an offset is not to be entered; empty where it is."""
    if zero.why:
        return zero.why if zero.why == NO_NUMBER else f"{NO_NUMBER}: {zero.why}"
    if zero.sigma_rad is not None and abs(zero.value_rad) < CLEAR * zero.sigma_rad:
        return f"less than {CLEAR:g} sigma"
    return ""


def _degrees(_: int) -> float:
    return math.degrees(1.0)


Floats = NDArray[np.float64]

BODIES = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
SAME_FRAME = 1e-12  # m and rad: rounding of a frame that stayed where it was


def ur_kinematics_text(arm: IdentifiedArm) -> str:
    """The YAML's text. DataError for an arm that has not six joints."""
    _six(arm)
    new = convert(arm.rig.arm, ArmModel.MDH, arm.corrections)  # offsets d in front of their turn, as ROS has them
    parts = corrected_parts(new.arm, new.corrections)
    parts[0] = new.T_base_new @ parts[0]
    lines = [
        "# Identified by calibeam; m and rad; roll, pitch, yaw about fixed axes, the joint then turns about its z",
        f"# {SIGN}",
        *(f"# {says}" for says in arm.not_carried),
        "kinematics:",
        *(line for name, part in zip(BODIES, parts[:-1], strict=True) for line in _yaml_pose(name, part, "  ")),
        "  hash: not_produced_by_calibeam  # the controller's own; the driver warns of the difference and goes on",
    ]
    if _moved(parts[-1]):
        lines.append(
            "# flange in wrist_3, which the form above cannot carry: give it to the driver as part of the tool"
        )
        lines += _yaml_pose("calibeam_flange", parts[-1], "")
    return "\n".join(lines) + "\n"


def ur_calibration_text(arm: IdentifiedArm) -> str:
    """The lists' text. DataError for an arm that has not six joints or no D-H base of its own."""
    _six(arm)
    drawn = convert(arm.rig.arm, ArmModel.DH)
    found = convert(arm.rig.arm, ArmModel.DH, arm.corrections, NearParallel.COMMON_NORMAL)
    if _moved(found.T_base_new):
        raise DataError(
            f"rig {arm.rig.name}: axis 1 is not z of the base, which calibration.conf cannot express; export a URDF"
        )
    delta = np.array(_four(found)) - np.array(_four(drawn))
    delta[:, [0, 3]] = (delta[:, [0, 3]] + np.pi) % (2.0 * np.pi) - np.pi
    rows = dict(zip(("delta_theta", "delta_d", "delta_a", "delta_alpha"), delta.T.tolist(), strict=True))
    lines = [
        "# Identified by calibeam: true = drawn + delta; m and rad; standard D-H without tilt, Rz Tz Tx Rx",
        f"# {SIGN}",
        *(f"# {says}" for says in arm.not_carried),
        "# joint_checksum, calibration_status, joint_raw_offset and joint_selftest_data_crc are the controller's own",
        "# and not produced: take the lists over into an existing file, never replace the file",
    ]
    T_drawn_found = inverse(_flange(drawn)) @ _flange(found)
    if _moved(T_drawn_found):
        rest = pose_of(T_drawn_found)
        lines.append(
            f"# left over at the flange: origin_m {list(rest.origin_m)}, rotation_rad {list(rest.rotation_rad)}"
        )
    lines.append("[mounting]")
    lines += [f"{key} = {rows[key]!r}" for key in ("delta_theta", "delta_a", "delta_d", "delta_alpha")]
    return "\n".join(lines) + "\n"


def _six(arm: IdentifiedArm) -> None:
    if arm.rig.n_joints != len(BODIES):
        raise DataError(f"rig {arm.rig.name}: {arm.rig.n_joints} joints; the forms of Universal Robots have six")


def _yaml_pose(name: str, T: Floats, indent: str) -> list[str]:
    values = (*T[:3, 3].tolist(), *roll_pitch_yaw(T[:3, :3]))
    keys = ("x", "y", "z", "roll", "pitch", "yaw")
    return [f"{indent}{name}:", *(f"{indent}  {k}: {v!r}" for k, v in zip(keys, values, strict=True))]


def _moved(T: Floats) -> bool:
    return bool(np.max(np.abs(T - np.eye(4))) > SAME_FRAME)


def _four(new: Conversion) -> list[tuple[float, ...]]:
    return [row[:4] for row in dh_numbers(new)]


def _flange(new: Conversion) -> Floats:
    return corrected_parts(new.arm, {})[-1]
