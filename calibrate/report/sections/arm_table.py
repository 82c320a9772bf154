"""Nominal, correction and calibrated value of every number of the arm's table, in degrees, mm and the robot's signs.

A joint that the rig file declares with `sign = -1` was turned round when the file was read: its nominal numbers are
those of the axis as the controller counts, and so are the corrections (acquisition/recording/rig/senses.py).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees

from acquisition.recording.rig import ArmModel, Joint, Rig
from calibrate.model_file import ModelParameter
from calibrate.report.elements import Html, folded, halves, table, tag
from calibrate.report.not_determined import reason_among
from calibrate.report.quantities import decimals_of, fixed
from calibrate.report.session_evidence import SessionEvidence

LEAD = (
    "Calibrated = nominal + correction, in the robot’s own signs: the true angle of a joint is its reading plus this "
    "offset. The calibrated values belong together; use all of them or none."
)
NOMINAL_DECIMALS = 2  # of a nominal value beside which there is no sigma


@dataclass(frozen=True)
class ArmNumber:
    """One number of the table, m or rad."""

    owner: str  # "J2", "link 3"
    what: str
    name: str  # of the parameter
    unit: str  # "m" or "rad"
    nominal: float
    correction: float | None  # None: not determined
    sigma: float | None
    why: str = ""  # there is no correction


def arm_numbers(rig: Rig, parameters: Sequence[ModelParameter]) -> tuple[ArmNumber, ...]:
    """Joint offsets first, then links; of an arm of poses only the offsets, since its links are no single numbers."""
    found = {p.name: p for p in parameters}
    listed = [
        (f"J{i}", "offset", f"joint{i}.zero", "rad", joint.theta_offset_rad or 0.0)
        for i, joint in enumerate(rig.arm.joints, start=1)
    ]
    if rig.arm.model is not ArmModel.LOCAL_POE:
        listed += [row for i, joint in enumerate(rig.arm.joints, start=1) for row in _link(rig.arm.model, i, joint)]
    return tuple(_number(found[row[2]], *row) for row in listed if row[2] in found)


def _link(model: ArmModel, i: int, joint: Joint) -> Iterator[tuple[str, str, str, str, float]]:
    """Owner, what, parameter, unit, nominal; a modified table has length and twist of the link in front."""
    behind = i - 1 if model is ArmModel.MDH else i
    yield f"link {i}", "d", f"link{i}.offset", "m", joint.d_m or 0.0
    yield f"link {behind}", "a", f"link{behind}.length", "m", joint.a_m or 0.0
    yield f"link {behind}", "alpha", f"link{behind}.twist", "rad", joint.alpha_rad or 0.0
    yield f"link {behind}", "tilt (beta)", f"link{behind}.tilt", "rad", 0.0


def _number(found: ModelParameter, owner: str, what: str, name: str, unit: str, nominal: float) -> ArmNumber:
    why = "" if found.value is not None else found.undetermined or "not determined"
    return ArmNumber(owner, what, name, unit, nominal, found.value, found.sigma, why)


def table_part(evidence: SessionEvidence) -> Iterator[Html]:
    """The joints' offsets, and folded the links; nothing where the model has none of them."""
    numbers = arm_numbers(evidence.recording.rig, evidence.model.parameters)
    joints = [n for n in numbers if n.what == "offset"]
    links = [n for n in numbers if n.what != "offset" and n.correction is not None]
    if not numbers:
        return
    yield tag("h3", "Nominal, correction, calibrated")
    yield tag("p", LEAD, cls="lead")
    if joints:
        yield _table(joints, evidence, ("Joint", "nominal (°)", "correction (°)", "± sigma (°)", "calibrated (°)"))
    if links:
        left = sum(n.what != "offset" for n in numbers) - len(links)
        title = f"Links: {len(links)} numbers" + (f"; {left} more are not determined" if left else "")
        head = ("Number", "nominal", "correction", "± sigma", "calibrated")
        yield folded(title, halves(_table(links, evidence, head)))


def _table(numbers: Sequence[ArmNumber], evidence: SessionEvidence, head: tuple[str, ...]) -> Html:
    return table(head, (_row(n, evidence) for n in numbers), numeric=(1, 2, 3, 4))


def _row(n: ArmNumber, evidence: SessionEvidence) -> tuple[str, ...]:
    joint = n.what == "offset"
    name = n.owner if joint else f"{n.owner}, {n.what} ({'mm' if n.unit == 'm' else '°'})"
    nominal = _in_unit(n, n.nominal)
    if n.correction is None or n.sigma is None:
        why = reason_among(n.name, evidence.model.unseen, n.why)
        return name, fixed(nominal, NOMINAL_DECIMALS), f"not determined: {why}"
    decimals = decimals_of(_in_unit(n, n.sigma))
    values = (nominal, _in_unit(n, n.correction), _in_unit(n, n.sigma), _in_unit(n, n.nominal + n.correction))
    return name, *(fixed(value, decimals) for value in values)


def _in_unit(n: ArmNumber, value: float) -> float:
    return 1e3 * value if n.unit == "m" else degrees(value)
