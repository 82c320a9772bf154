"""Two forms for arms of Universal Robots: the kinematics YAML of the ROS description, and the controller's lists.

YAML: ur_description, config/<type>/default_kinematics.yaml: origins of the six joints in front of their turn, as in
URDF, the first one in base_link_inertia, which is the controller's base. Controller: calibration.conf, section
[mounting], delta_theta, delta_a, delta_d, delta_alpha added to the published D-H table; four numbers a joint and no
tilt, so that delta_d of the parallel axes runs to metres (forum.universal-robots.com, 18921, shows one). The hash of
the YAML and the checksums of the .conf are computed by the controller and cannot be produced here.
"""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import ArmModel
from calibrate.apply.export.dh_csv import dh_numbers
from calibrate.apply.export.identified import SIGN, IdentifiedArm, roll_pitch_yaw
from calibrate.errors import DataError
from calibrate.model.arms.convert import (
    Conversion,
    convert,
    corrected_parts,
    pose_of,
)
from calibrate.model.arms.table import NearParallel
from calibrate.model.rigid import inverse

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
