"""One finding, one page: sentence, picture, place, size, proof, rivals, what to do."""

from collections.abc import Iterator, Sequence

from calibrate.diagnose.schema import DiagnosisFile, FindingRecord, RivalRecord, SizeRecord
from calibrate.report.diagnosis.chain_figure import Link, chain_figure
from calibrate.report.diagnosis.pulled_figure import pulled_figure
from calibrate.report.diagnosis.units import unit_of
from calibrate.report.diagnosis.words import place_words
from calibrate.report.elements import Html, facts, figure, panels, section, table, tag
from calibrate.report.quantities import DASH, TIED, decimals_of, fixed, significant

TWO_SIDED = 1.96  # sigmas of 95 %
SURE = 1e-6  # probability below which only its smallness is told


def finding_page(number: int, finding: FindingRecord, file: DiagnosisFile, chain: Sequence[Link]) -> Html:
    """Chapter `finding-<number>`, from 1."""
    pictures = [figure(chain_figure(str(number), finding.where, chain), f"Where it sits: {finding.where}.")]
    if finding.curve is not None:
        caption = (
            "What the readings show of it, divided by how they feel this place; the line is the fitted curve. "
            "Readings that hardly feel it are left out."
        )
        single = "," not in finding.depends_on
        pictures.insert(0, figure(pulled_figure(str(number), finding.curve, single=single), caption))
    return section(
        f"finding-{number}",
        f"{number}. {finding.says}",
        finding.explains or "No physics of the catalogue fits it: only the dependence is reported.",
        panels(*pictures),
        _sizes(finding),
        facts(_proof(finding)),
        *_rivals(finding, file),
    )


def title_of(finding: FindingRecord) -> str:
    """For the contents."""
    return f"{finding.physics}, {finding.where}"


def _sizes(finding: FindingRecord) -> Html:
    rows = [(name, size_words(name, size), interval_words(name, size)) for name, size in finding.parameters.items()]
    head = ("Parameter", "size ± sigma", "95 % interval")
    return table(head, rows, numeric=(1, 2), caption=place_words(finding))


def size_words(name: str, size: SizeRecord) -> str:
    """With a unit that fits, from the unit in the name."""
    if size.value is None or size.sigma is None:
        return DASH
    factor, unit = unit_of(name, size.value)
    decimals = decimals_of(factor * size.sigma)
    value, sigma = fixed(factor * size.value, decimals), fixed(factor * size.sigma, decimals)
    return f"{value}{TIED}±{TIED}{sigma}{unit}"


def interval_words(name: str, size: SizeRecord) -> str:
    """'40.6 to 46.5 µrad per rad'; a dash for what was counted."""
    if size.value is None or size.sigma is None or not size.sigma > 0.0:
        return DASH
    factor, unit = unit_of(name, size.value)
    decimals, half = decimals_of(factor * size.sigma), TWO_SIDED * factor * size.sigma
    return f"{fixed(factor * size.value - half, decimals)} to {fixed(factor * size.value + half, decimals)}{unit}"


def _proof(finding: FindingRecord) -> Iterator[tuple[str, str]]:
    if finding.stream is not None:
        yield "found in", f"the stream of {finding.stream}{_when(finding)}"
    if finding.share is not None:
        yield "share of what all findings explain", f"{fixed(100.0 * finding.share, 0)} %"
    if finding.plausible_to is not None and finding.parameters:
        name = next(iter(finding.parameters))
        factor, unit = unit_of(name, finding.plausible_to)
        yield "a machine shows at most", f"{significant(factor * finding.plausible_to)}{unit}"
    yield "confidence in the name", f"{finding.confidence:.3f}"
    chance = f"below {significant(SURE, 1)}" if finding.p < SURE else significant(finding.p, 2)
    yield "chance that noise alone resembles any cause as much", chance
    if finding.bic_gain is not None and finding.held_out_gain is not None:
        yield "information it brings (BIC)", fixed(finding.bic_gain, 1)
        yield "gain on samples held out (2 ln L)", fixed(finding.held_out_gain, 1)


def _when(finding: FindingRecord) -> str:
    if finding.from_s is None:
        return ""
    until = "" if finding.to_s is None else f" to {fixed(finding.to_s, 3)}"
    return f", {fixed(finding.from_s, 3)}{until} s on its clock"


def _rivals(finding: FindingRecord, file: DiagnosisFile) -> Iterator[Html]:
    if not finding.rivals:
        if finding.stream is None:
            yield tag("p", "No other cause of the catalogue comes near: within 6 BIC there is none.")
        return
    rows = [(_rival_words(r), fixed(r.margin + 0.0, 1), f"{r.confidence:.3f}") for r in finding.rivals]
    caption = "What it could be instead, everything else refitted"
    yield table(("Rival", "BIC behind", "confidence"), rows, numeric=(1, 2), caption=caption)
    advice = [line for line in file.next if finding.where in line and finding.physics in line]
    if advice:
        yield tag("p", tag("b", "What to do: "), "; ".join(advice), ".")


def _rival_words(rival: RivalRecord) -> str:
    return place_words(rival) + ("" if rival.plausible else ": only with a size that no machine has")
