"""Joint offsets for the zero positions of industrial controllers: KUKA's mastering, ABB's motor offsets, FANUC's.

One meaning in all of them: the true angle of an axis is its reading plus its offset, in the robot's own signs. When an
offset has been entered and the arm has not moved, the reading has changed by just that. Sources, where numbers are
entered and what could not be tried: docs/controllers.
"""

import math
from collections.abc import Callable

from acquisition.recording.rig import Rig
from calibrate.apply.export.identified import NO_NUMBER, AxisOffset, IdentifiedArm
from calibrate.apply.export.nominal_table import quoted, to_sigma

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
