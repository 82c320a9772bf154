"""D-H table of an identified arm as CSV: base, one row a joint with Hayati's tilt, flange."""

from acquisition.recording.rig import ArmModel, Pose
from calibrate.arms.convert import Conversion, convert, pose_of
from calibrate.export.identified import IdentifiedArm

TABLE = ("theta_offset_rad", "d_m", "a_m", "alpha_rad", "tilt_rad")
FRAME = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")


def dh_csv_text(arm: IdentifiedArm) -> str:
    """The file's text; lines with # are its explanation."""
    new = convert(arm.rig.arm, ArmModel.DH, arm.corrections)
    lines = [
        "# Standard Denavit-Hartenberg table, identified by calibeam; m and rad",
        "# T_base_flange = base T_1 ... T_n flange; T_i = Rz(q_i + theta_offset) Tz(d) Tx(a) Rx(alpha) Ry(tilt)",
        f"# {arm.sign}",
        *(f"# {says}" for says in arm.not_carried),
        "# base and flange: origin x, y, z and rotation vector rx, ry, rz (axis times angle)",
        ",".join(("row", *TABLE, *FRAME)),
        _frame("base", pose_of(new.T_base_new)),
        *(
            ",".join((str(i), *(repr(v) for v in row), *("" for _ in FRAME)))
            for i, row in enumerate(dh_numbers(new), start=1)
        ),
        _frame("flange", new.arm.flange),
    ]
    return "\n".join(lines) + "\n"


def dh_numbers(new: Conversion) -> list[tuple[float, float, float, float, float]]:
    """A row a joint: theta offset, d, a, alpha, tilt."""
    return [
        (
            j.theta_offset_rad or 0.0,
            j.d_m or 0.0,
            j.a_m or 0.0,
            j.alpha_rad or 0.0,
            new.corrections.get(f"link{i}.tilt", 0.0),
        )
        for i, j in enumerate(new.arm.joints, start=1)
    ]


def _frame(name: str, pose: Pose) -> str:
    return ",".join((name, *("" for _ in TABLE), *(repr(v) for v in (*pose.origin_m, *pose.rotation_rad))))
