"""Every number of the nominal arm, its correction, and as calibrated: in degrees and mm, in the signs of the robot.

Axes are angles at a reading of zero, in the senses and couplings of the controller: an axis that reads r stands at
r + value. Links are the numbers of the arm model. A correction of a D-H table adds to the drawn number. Of a local-POE
arm, x, y, z are those of the next axis seen in its own frame, to which the correction adds, and turns are separated
from the drawn part, so they are drawn as zero. Where the recording determines no number, the reason stands in its
place. An arm that was fitted as poses has the rows of its D-H table, where the model holds what is determined of it.
As CSV the table stands alone; as JSON beside the fixed parts as matrices and the D-H table of the same arm.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import ArmModel, Joint, Make, Pose
from calibrate.apply.export.dh_table import FRAME, TABLE, dh_arm, dh_numbers
from calibrate.apply.export.identified import NO_NUMBER, IdentifiedArm
from calibrate.fit.rank import in_plain_words, plainly
from calibrate.model.arms.convert import convert, pose_of
from calibrate.model.arms.coupled_readings import by_reading
from calibrate.quantities import decimals_of, fixed

ZERO = (0.0, 0.0, 0.0)
AXIS = {Make.KUKA: "A"}  # what the makes call their axes; J elsewhere
DEGREES, MILLIMETRES = (math.degrees(1.0), "deg"), (1e3, "mm")
DH = (("offset", "d_m"), ("length", "a_m"), ("twist", "alpha_rad"), ("tilt", None))  # correction, drawn number
POE = ("x", "y", "z", "roll", "pitch", "yaw")
UNIT = {"deg": "°", "mm": "mm"}
NO_DH = "for its D-H table identify the recording again"
NOMINAL_DECIMALS = 2  # of a nominal value beside which there is no sigma
HEADING = ("parameter", "unit", "nominal", "correction", "sigma", "calibrated", "not_determined_because")


@dataclass(frozen=True)
class NominalRow:
    """One number in its unit; `correction`, `sigma`, `calibrated` are None where `why` has the reason."""

    parameter: str  # A2 or J2 of an axis, else the name in model.json
    unit: str  # "deg" or "mm"
    nominal: float
    correction: float | None
    sigma: float | None
    calibrated: float | None
    why: str


def nominal_table(arm: IdentifiedArm) -> tuple[NominalRow, ...]:
    """Axes first, then links; numbers that the arm does not have as parameters are left out."""
    arm = dh_arm(arm.rig, arm.corrections, arm.dh_table) if arm.dh_table else arm
    return (*_axes(arm), *_links(arm))


def nominal_table_text(arm: IdentifiedArm) -> str:
    """CSV; lines with # are its explanation."""
    lines = [
        "# Nominal, correction, calibrated = nominal + correction, identified by calibeam; degrees and millimetres",
        "# axes: the angle at a reading of zero, in the robot's own signs: an axis that reads r stands at r + angle",
        f"# links: {_what_links_are(arm)}",
        *(f"# {says}" for says in arm.not_carried),
        ",".join(HEADING),
    ]
    for row in nominal_table(arm):
        numbers = (to_sigma(value, row.sigma) for value in (row.correction, row.sigma, row.calibrated))
        lines.append(",".join((row.parameter, row.unit, repr(row.nominal), *numbers, quoted(row.why))))
    return "\n".join(lines) + "\n"


def _what_links_are(arm: IdentifiedArm) -> str:
    if arm.dh_table:
        return "the standard Denavit-Hartenberg table: offset d, length a, twist alpha, Hayati's tilt beta"
    says = f"the numbers of the arm model '{arm.rig.arm.model.value}', as counted by the controller"
    return f"{says}; {NO_DH}" if arm.rig.arm.model is ArmModel.LOCAL_POE and arm.stated else says


def cells(row: NominalRow) -> tuple[str, ...]:
    """Name, nominal, correction, sigma, calibrated for a person; the reason in place of the last three."""
    name = f"{row.parameter if '.' not in row.parameter else plainly([row.parameter])} ({UNIT[row.unit]})"
    if row.correction is None or row.sigma is None or row.calibrated is None:
        head, _, words = row.why.rpartition(": ")
        why = f"{head}: {in_plain_words(words)}" if " + " in words else row.why
        return name, fixed(row.nominal, NOMINAL_DECIMALS), f"{NO_NUMBER}: {why}" if why != NO_NUMBER else why
    decimals = decimals_of(row.sigma)
    return name, *(fixed(v, decimals) for v in (row.nominal, row.correction, row.sigma, row.calibrated))


def to_sigma(value: float | None, sigma: float | None) -> str:
    """A cell: a value to the second digit of its sigma, in full where there is none; empty for no value."""
    if value is None:
        return ""
    return f"{value:z.{decimals_of(sigma)}f}" if sigma else repr(value)


def quoted(says: str) -> str:
    """A cell of words."""
    return f'"{says.replace(chr(34), chr(39))}"' if "," in says else says


def _axes(arm: IdentifiedArm) -> Iterator[NominalRow]:
    drawn = np.array([joint.theta_offset_rad or 0.0 for joint in arm.rig.arm.joints])
    matrix = by_reading(arm.rig.arm)
    if matrix is not None:
        drawn = np.linalg.solve(matrix, drawn)
    letter = AXIS.get(arm.rig.arm.make, "J") if arm.rig.arm.make is not None else "J"
    for zero, nominal in zip(arm.zeros, drawn.tolist(), strict=True):
        value = None if zero.why else zero.value_rad
        yield _row(f"{letter}{zero.joint}", DEGREES, nominal, value, zero.sigma_rad, zero.why)


def _links(arm: IdentifiedArm) -> Iterator[NominalRow]:
    stated = {p.name: p for p in arm.stated}
    for name, unit, nominal in _drawn(arm):
        if name in stated:
            found = stated[name]
            yield _row(name, unit, nominal, found.value, found.sigma, found.undetermined or NO_NUMBER)


def _drawn(arm: IdentifiedArm) -> Iterator[tuple[str, tuple[float, str], float]]:
    """Name of the correction, unit, drawn number in m or rad."""
    joints = arm.rig.arm.joints
    if arm.rig.arm.model is ArmModel.LOCAL_POE:
        flange = arm.rig.arm.flange
        parts = [*(Pose(j.origin_m or ZERO, j.rotation_rad or ZERO) for j in joints), flange]
        for i, part in enumerate(parts):
            origin_m = Rotation.from_rotvec(part.rotation_rad).inv().apply(part.origin_m).tolist()
            for axis, drawn in zip(POE, (*origin_m, 0.0, 0.0, 0.0), strict=True):
                yield f"link{i}.{axis}", MILLIMETRES if axis in "xyz" else DEGREES, drawn
        return
    # a, alpha of a modified table stand in front of their joint: they are the link's before it
    before = 1 if arm.rig.arm.model is ArmModel.MDH else 0
    for i, joint in enumerate(joints, start=1):
        for name, key in DH:
            link = i if name == "offset" else i - before
            yield f"link{link}.{name}", MILLIMETRES if name in ("offset", "length") else DEGREES, _number(joint, key)


def _number(joint: Joint, key: str | None) -> float:
    value: float | None = None if key is None else getattr(joint, key)
    return value or 0.0


def _row(
    name: str, unit: tuple[float, str], nominal: float, value: float | None, sigma: float | None, why: str
) -> NominalRow:
    scale, word = unit
    if value is None:
        return NominalRow(name, word, _short(scale * nominal), None, None, None, why)
    spread = None if sigma is None else _short(scale * sigma)
    return NominalRow(
        name, word, _short(scale * nominal), _short(scale * value), spread, _short(scale * (nominal + value)), ""
    )


def _short(number: float) -> float:
    return round(number, 9) + 0.0  # a pm, a hundredth of a nrad: no rounding errors such as 4.9e-14 mm, no -0.0


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
