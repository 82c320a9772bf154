"""The first page: what was found, how well, and what stayed open."""

from collections.abc import Sequence
from math import degrees, isfinite, radians

from calibrate.identification.evidence_record import EvidenceFields
from calibrate.report.answers import Answers, Number, first_screen
from calibrate.report.anywhere import anywhere
from calibrate.report.elements import Html, figure, panels, table, tag
from calibrate.report.evidence import Evidence
from calibrate.report.quantities import aligned, angle, decimals_of, fixed, length, significant
from calibrate.report.reasons import plain_reason
from calibrate.report.summary_figures import doubts, explained
from calibrate.report.verdict import limited_by_measurement, verdict
from calibrate.zeros.result import JointZero


def masthead(evidence: Evidence) -> Html:
    """Title, when and with what."""
    recording, rig = evidence.recording, evidence.recording.rig
    when = recording.started_utc.partition(".")[0].replace("T", " ")
    said = [f"{when} UTC"] if when else []
    said += [f"{evidence.result.n_poses} poses at {len(evidence.places)} fixture places", evidence.result.software]
    return tag(
        "header",
        tag("p", "Joint zero identification with laser and dual PSD", cls="kicker"),
        tag("h1", rig.name),
        tag("p", " · ".join(said), cls="byline"),
    )


def summary(said: Answers, evidence: Evidence) -> Html:
    """Verdict, three numbers, the zeros in short."""
    zeros, lead = evidence.result.zeros, "True joint angle = reading + zero. Sigma is one standard deviation."
    content = [first_screen(said), tag("h3", "Joint zeros"), tag("p", lead, cls="lead"), _zeros(evidence)]
    if any(z.sigma_rad is not None for z in zeros):
        caption = (
            "How well each zero is known, on a logarithmic axis. A long line means that measuring more will not help: "
            "the tolerance of the drawing is the limit, because these data cannot tell the zero from the links."
        )
        content.append(panels(figure(doubts(zeros), caption), *_explained(evidence)))
    return tag("div", *content, id="summary")


def answers(evidence: Evidence, proved: EvidenceFields | None = None) -> Answers:
    """How good, whether to trust it, what to do. `proved`: what holds anywhere, where it was asked for."""
    return Answers(verdict(evidence), _numbers(evidence, proved), _limits(evidence), _also(evidence))


def _numbers(evidence: Evidence, proved: EvidenceFields | None) -> tuple[Number, Number, Number]:
    result, unseen = evidence.result, evidence.result.held_out
    before, after = result.rms_before_m, result.rms_after_m
    on = "rms of the spots of the fit itself"
    if unseen is not None:
        before, after = unseen.rms_before_m, unseen.rms_after_m
        on = f"rms of the spots at {unseen.poses} poses that the fit has not seen"
    return (
        Number("as_drawn", "Spots off as drawn", before, "m", length(before), f"{on}; arm as the drawing says"),
        Number("now", "Spots off identified", _finite(after), "m", length(after), on + _gain(before, after)),
        anywhere(None if proved is None else proved["free_space"]),
    )


def _also(evidence: Evidence) -> tuple[str, ...]:
    result, expected = evidence.result, evidence.expected
    found = [z for z in result.zeros if z.value_rad is not None]
    said = [f"{len(found)} of {len(result.zeros)} zeros determined: {_names(found) or 'none'}"]
    if expected is not None:
        said.append(f"noise floor of joints and detectors, as found: {length(expected.floor_m)}")
    return (*said, f"spots of the fit: {length(result.rms_after_m)} rms, {length(result.rms_before_m)} before")


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _limits(evidence: Evidence) -> tuple[str, ...]:
    """What a reader must know before using the numbers: zeros that the drawing limits, zeros that are missing."""
    zeros, said = evidence.result.zeros, list[str]()
    loose = [z for z in zeros if z.value_rad is not None and not limited_by_measurement(z)]
    if loose:
        worst = max(z.sigma_rad or 0.0 for z in loose)
        limit = "limited by the drawing's tolerance, not by the measurement"
        said.append(f"{_names(loose)}: known to {angle(worst)} only, {limit}.")
    open_ = [z for z in zeros if z.value_rad is None]
    said += [f"J{z.joint}: not determined; {_reason(z, evidence)}." for z in open_]
    return tuple(said)


def _names(zeros: Sequence[JointZero]) -> str:
    return ", ".join(f"J{z.joint}" for z in zeros)


def _reason(zero: JointZero, evidence: Evidence) -> str:
    return plain_reason(f"joint{zero.joint}.zero", evidence.result.identifiability, zero.why)


def _gain(before_m: float, after_m: float) -> str:
    if not isfinite(after_m):
        return "; no finite fit"
    return f"; {significant(before_m / after_m)} times better" if after_m > 0.0 else ""


def _explained(evidence: Evidence) -> list[Html]:
    """How far the spots are explained, against the floor below which there is only noise."""
    result, expected, unseen = evidence.result, evidence.expected, evidence.result.held_out
    if expected is None:
        return []
    sizes = [("before the fit", result.rms_before_m), ("after the fit", result.rms_after_m)]
    sizes += [] if unseen is None else [("unseen poses", unseen.rms_after_m)]
    caption = (
        "How far the spots are from where the model expects them. The dashed line is the noise floor: no model of the "
        "arm can get below it on poses that it has not seen."
    )
    return [figure(explained(sizes, expected.floor_m), caption)]


def _zeros(evidence: Evidence) -> Html:
    """Value and sigma in degrees, one line a joint."""
    zeros = evidence.result.zeros
    known = [z for z in zeros if z.value_rad is not None and z.sigma_rad is not None]
    values = aligned([fixed(degrees(z.value_rad or 0.0), _decimals(z)) for z in known])
    sigmas = aligned([fixed(degrees(z.sigma_rad or 0.0), _decimals(z)) for z in known])
    micro = aligned([significant(1e6 * (z.sigma_rad or 0.0), 2) for z in known])
    numbers = {z.joint: row for z, *row in zip(known, values, sigmas, micro, strict=True)}
    rows: list[tuple[str, ...]] = []
    for z in zeros:
        if z.joint not in numbers:
            rows.append((f"J{z.joint}", f"not determined: {_reason(z, evidence)}"))
            continue
        limit = "measurement" if limited_by_measurement(z) else "drawing tolerance of the links"
        rows.append((f"J{z.joint}", *numbers[z.joint], limit))
    return table(("Joint", "zero (°)", "± sigma (°)", "± sigma (µrad)", "limited by"), rows, numeric=(1, 2, 3))


def _decimals(zero: JointZero) -> int:
    return decimals_of(degrees(zero.sigma_rad if zero.sigma_rad is not None else radians(1e-3)))
