"""The table of joint zeros, and what limits each of them."""

from collections.abc import Iterator, Sequence
from math import degrees

from calibrate.default_belief import links_of
from calibrate.identification.estimates import Estimate, JointZero, joint_zeros
from calibrate.report.elements import Html, figure, table, tag
from calibrate.report.not_determined import reason_among
from calibrate.report.quantities import DASH, aligned, angle, decimals_of, fixed, significant
from calibrate.report.session_evidence import SessionEvidence
from calibrate.report.workspace.known_arm import whole_covariance
from calibrate.report.zero_figure import doubts
from calibrate.sensors import spots

ZEROS = "Joint zeros"
SMALL_SHARE = 0.5  # measurement under this share of sigma: something else limits the zero


def zeros_of(evidence: SessionEvidence) -> tuple[JointZero, ...]:
    """Joint zeros of the model; none where the arm has no such parameters."""
    parameters = evidence.parameters
    stated = (Estimate(p.name, p.unit, p.value, p.sigma, p.undetermined) for p in evidence.model.parameters)
    return joint_zeros(stated, parameters, whole_covariance(evidence.model.covariance, parameters))


def limited_by_measurement(zero: JointZero) -> bool:
    """Whether more poses would make the zero better; False: the tolerance of the links is the limit."""
    if zero.measurement_sigma_rad is None or zero.sigma_rad is None:
        return True
    return zero.measurement_sigma_rad >= SMALL_SHARE * zero.sigma_rad


def zeros_part(evidence: SessionEvidence) -> Iterator[Html]:
    """Heading and table; with spots of the dual PSD also what the measurement alone leaves of each sigma."""
    zeros = zeros_of(evidence)
    if not zeros:
        return
    lead = "True joint angle = reading + zero. Sigma is one standard deviation. All other parameters are further down."
    yield tag("p", lead, cls="lead")
    if spots.KIND.name not in evidence.model.instruments:
        yield table(("Joint", "zero (°)", "± sigma (°)", "± sigma (µrad)"), _rows(evidence, zeros), numeric=(1, 2, 3))
        return
    head = ("Joint", "zero (°)", "± sigma (°)", "± sigma (µrad)", "of measurement alone (µrad)", "limited by")
    yield table(head, _rows(evidence, zeros, limits=True), numeric=(1, 2, 3, 4))
    yield tag("p", _reading(evidence), cls="lead")
    if any(z.sigma_rad is not None for z in zeros):
        caption = (
            "How well each zero is known, on a logarithmic axis. A long line means that measuring more will not help: "
            "the assumed tolerance of the links is the limit, because these data cannot separate the zero from the "
            "links."
        )
        yield figure(doubts(zeros), caption)


def limits_of_zeros(evidence: SessionEvidence) -> Iterator[str]:
    """What a reader must know before using the zeros of a session with spots; nothing for other instruments."""
    if spots.KIND.name not in evidence.model.instruments:
        return
    zeros = zeros_of(evidence)
    loose = [z for z in zeros if z.value_rad is not None and not limited_by_measurement(z)]
    if loose:
        worst = max(z.sigma_rad or 0.0 for z in loose)
        limit = "limited by the assumed tolerance of the links, not by the measurement"
        yield f"{_names(loose)}: known to {angle(worst)} only, {limit}."
    for z in zeros:
        if z.value_rad is None:
            yield f"J{z.joint}: not determined; {_reason(z, evidence)}."


def determined(evidence: SessionEvidence) -> str:
    """How many zeros have a number, and which."""
    zeros = zeros_of(evidence)
    found = [z for z in zeros if z.value_rad is not None]
    return f"{len(found)} of {len(zeros)} zeros determined: {_names(found) or 'none'}"


def _rows(evidence: SessionEvidence, zeros: Sequence[JointZero], *, limits: bool = False) -> list[tuple[str, ...]]:
    """Value and sigma in degrees, one line a joint; never a number for what is not determined."""
    known = [z for z in zeros if z.value_rad is not None and z.sigma_rad is not None]
    columns = [
        aligned([fixed(degrees(z.value_rad or 0.0), _decimals(z)) for z in known]),
        aligned([fixed(degrees(z.sigma_rad or 0.0), _decimals(z)) for z in known]),
        aligned([significant(1e6 * (z.sigma_rad or 0.0), 2) for z in known]),
    ]
    if limits:
        columns.append(aligned([_alone(z) for z in known]))
        columns.append(["measurement" if limited_by_measurement(z) else "tolerance of the links" for z in known])
    numbers = {z.joint: row for z, *row in zip(known, *columns, strict=True)}
    return [(f"J{z.joint}", *numbers.get(z.joint, [f"not determined: {_reason(z, evidence)}"])) for z in zeros]


def _reading(evidence: SessionEvidence) -> str:
    links = links_of(evidence.recording.rig)
    return (
        f"Sigma includes what the links may be off the drawing ({links.length_sigma_m * 1e3:g} mm, "
        f"{angle(links.angle_sigma_rad)}) as far as these data do not determine it. “Of measurement alone” is what "
        "would remain if links and bracket were exactly as now fitted."
    )


def _decimals(zero: JointZero) -> int:
    return decimals_of(degrees(zero.sigma_rad or 0.0))


def _alone(zero: JointZero) -> str:
    return DASH if zero.measurement_sigma_rad is None else significant(1e6 * zero.measurement_sigma_rad, 2)


def _names(zeros: Sequence[JointZero]) -> str:
    return ", ".join(f"J{z.joint}" for z in zeros)


def _reason(zero: JointZero, evidence: SessionEvidence) -> str:
    return reason_among(f"joint{zero.joint}.zero", evidence.model.unseen, zero.why)
