"""JSON of an identified arm: the fixed parts as matrices, and the D-H table of the same arm."""

import msgspec

from acquisition.recording.rig import ArmModel
from calibrate.apply.export.dh_csv import FRAME, TABLE, dh_numbers
from calibrate.apply.export.identified import IdentifiedArm
from calibrate.apply.export.nominal_table import nominal_table
from calibrate.model.arms.convert import convert, pose_of
from calibrate.model.arms.coupled_readings import by_reading


def json_text(arm: IdentifiedArm) -> str:
    """The file's text; `convention` explains the other keys."""
    new = convert(arm.rig.arm, ArmModel.DH, arm.corrections)
    base, flange = pose_of(new.T_base_new), new.arm.flange
    content = {
        "schema": 1,
        "kind": "calibeam-arm",
        "name": arm.rig.name,
        "convention": {
            "units": "m, rad",
            "sign": arm.sign,
            "parts": "T_base_flange = F_0 Rz(q_1) F_1 ... Rz(q_n) F_n; 4x4 row by row",
            "dh": "T_base_flange = base T_1 ... T_n flange; T_i = Rz(q_i + theta_offset) Tz(d) Tx(a) Rx(alpha)"
            " Ry(tilt); rx, ry, rz is a rotation vector",
            "table": "degrees and millimetres, in the robot's own signs; calibrated = nominal + correction",
            "tool_point_m": "in the flange frame",
        },
        "joints": [{"lower_rad": low, "upper_rad": high} for low, high in arm.limits_rad],
        "parts": arm.parts.tolist(),
        "dh": {
            "base": dict(zip(FRAME, (*base.origin_m, *base.rotation_rad), strict=True)),
            "rows": [dict(zip(TABLE, row, strict=True)) for row in dh_numbers(new)],
            "flange": dict(zip(FRAME, (*flange.origin_m, *flange.rotation_rad), strict=True)),
        },
        "table": nominal_table(arm),
        "tool_point_m": arm.tool_m,
        "not_carried": arm.not_carried,
    }
    matrix = by_reading(arm.rig.arm)
    if matrix is not None:
        content["angles_by_readings"] = matrix.tolist()  # q = matrix times readings
    return msgspec.json.format(msgspec.json.encode(content), indent=1).decode() + "\n"
