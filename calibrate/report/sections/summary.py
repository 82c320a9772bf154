"""The first page: what was found, how well, and what stayed open."""

from collections.abc import Sequence
from math import degrees, isfinite, radians

from calibrate.report.elements import Html, bullets, figure, panels, table, tag
from calibrate.report.evidence import Evidence
from calibrate.report.quantities import aligned, angle, decimals_of, fixed, length, significant
from calibrate.report.reasons import plain_reason
from calibrate.report.summary_figures import doubts, explained
from calibrate.report.tiles import tile
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


def summary(evidence: Evidence) -> Html:
    """Verdict, four numbers, the zeros in short."""
    zeros, lead = evidence.result.zeros, "True joint angle = reading + zero. Sigma is one standard deviation."
    content = [_verdict(evidence), _tiles(evidence), tag("h3", "Joint zeros"), tag("p", lead, cls="lead")]
    content.append(_zeros(evidence))
    if any(z.sigma_rad is not None for z in zeros):
        caption = (
            "How well each zero is known, on a logarithmic axis. A long line means that measuring more will not help: "
            "the tolerance of the drawing is the limit, because these data cannot tell the zero from the links."
        )
        content.append(panels(figure(doubts(zeros), caption), *_explained(evidence)))
    return tag("div", *content, id="summary")


def _verdict(evidence: Evidence) -> Html:
    judged = verdict(evidence)
    rest = [bullets(judged.reasons)] if judged.reasons else []
    return tag("div", tag("strong", judged.sentence), *_limits(evidence), *rest, cls=f"verdict {judged.trust.value}")


def _limits(evidence: Evidence) -> list[Html]:
    """What a reader must know before using the numbers: zeros that the drawing limits, zeros that are missing."""
    zeros, said = evidence.result.zeros, list[Html]()
    loose = [z for z in zeros if z.value_rad is not None and not limited_by_measurement(z)]
    if loose:
        worst = max(z.sigma_rad or 0.0 for z in loose)
        limit = "limited by the drawing's tolerance, not by the measurement"
        text = f"{_names(loose)}: known to {angle(worst)} only, {limit}."
        said.append(tag("p", text))
    open_ = [z for z in zeros if z.value_rad is None]
    said += [tag("p", f"J{z.joint}: not determined; {_reason(z, evidence)}.") for z in open_]
    return said


def _names(zeros: Sequence[JointZero]) -> str:
    return ", ".join(f"J{z.joint}" for z in zeros)


def _reason(zero: JointZero, evidence: Evidence) -> str:
    return plain_reason(f"joint{zero.joint}.zero", evidence.result.identifiability, zero.why)


def _tiles(evidence: Evidence) -> Html:
    result, expected, unseen = evidence.result, evidence.expected, evidence.result.held_out
    found = [z for z in result.zeros if z.value_rad is not None]
    tiles = [
        tile("Zeros determined", f"{len(found)} of {len(result.zeros)}", _names(found) or "none"),
        tile("Spots off before", length(result.rms_before_m), "rms, arm as drawn at the best places"),
        tile("Spots off after", length(result.rms_after_m), _gain(result.rms_before_m, result.rms_after_m)),
    ]
    if expected is not None:
        tiles.append(tile("Noise floor", length(expected.floor_m), "rms of joints and detectors, as found"))
    if unseen is not None:
        tiles.append(
            tile("Unseen poses", length(unseen.rms_after_m), f"rms on {unseen.poses} poses kept out of the fit")
        )
    return tag("div", *tiles, cls="tiles")


def _gain(before_m: float, after_m: float) -> str:
    if not isfinite(after_m):
        return "no finite fit"
    return f"rms, {significant(before_m / after_m)} times better" if after_m > 0.0 else "rms"


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
