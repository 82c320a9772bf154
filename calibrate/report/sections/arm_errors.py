"""The chapter on errors before and after, instrument by instrument, and on patterns in what remains."""

import numpy as np

from calibrate.quantities import fixed, significant
from calibrate.report.elements.html import (
    Html,
    figure,
    folded,
    panels,
    section,
    table,
    tag,
)
from calibrate.report.evidence.session_evidence import Readings, SessionEvidence
from calibrate.report.evidence.session_verdict import GROUPS, Pattern, patterns_of
from calibrate.report.figures.error_figures import (
    MOST_POINTS,
    along,
    by_sample,
    errors,
    histogram,
    quantiles,
)

TITLE = "Errors before and after"


def errors_chapter(evidence: SessionEvidence) -> Html:
    """All instruments in one table, then each by itself."""
    lead = (
        "Expected minus observed. Nominal: nominal arm, with frames, target and cones where they fit best. "
        "Calibrated: all fitted. An error is the length of the difference, in 3-D for a position."
    )
    rows = [row for readings in evidence.readings for row in _figures(readings)]
    head = ("Reading", "state", "count", "rms distance", "mean", "95 %", "largest")
    each = (part for i in range(len(evidence.readings)) for part in _instrument(evidence, i))
    return section("errors", TITLE, lead, table(head, rows, numeric=(2, 3, 4, 5, 6)), *each)


def _figures(readings: Readings) -> list[tuple[str, ...]]:
    out: list[tuple[str, ...]] = []
    for state, values in (("nominal", readings.error_before), ("calibrated", readings.error_after)):
        numbers = (np.sqrt(np.mean(values**2)), values.mean(), np.percentile(values, 95.0), values.max())
        name = readings.title if state == "nominal" else ""
        out.append((name, state, str(len(values)), *(readings.says(float(n)) for n in numbers)))
    return out


def _instrument(evidence: SessionEvidence, index: int) -> list[Html]:
    readings = evidence.readings[index]
    found = patterns_of(evidence, index)
    out = [tag("h3", readings.title)]
    out.append(_before_and_after(readings))
    out.append(_noise_like(readings))
    if found:
        out += [tag("div", figure(along(readings, found), _caption(found)), cls="wide"), _pattern_table(found)]
    else:
        out.append(tag("p", "Too few readings to search for patterns along the joints."))
    return out


def _before_and_after(readings: Readings) -> Html:
    some = f" {MOST_POINTS} of them are drawn." if len(readings.rows) > MOST_POINTS else ""
    return panels(
        figure(errors(readings), "Every reading, before and after, on a logarithmic axis."),
        figure(by_sample(readings), f"The same in the order of the file: a drift or a knock would show here.{some}"),
    )


def _noise_like(readings: Readings) -> Html:
    whitened = readings.whitened
    beyond = int(np.sum(np.abs(whitened) > 3.0))
    return panels(
        figure(
            quantiles(whitened, f"quantiles-{readings.name}"),
            "In units of the noise found. Points on the line, within the grey band: pure noise. An S shape: more large "
            "values than noise gives.",
        ),
        figure(
            histogram(whitened, f"histogram-{readings.name}"),
            f"{beyond} of {whitened.size} coordinates lie beyond three sigma; noise alone gives "
            f"{significant(0.0027 * whitened.size, 2)} on average.",
        ),
    )


def _caption(found: tuple[Pattern, ...]) -> str:
    return (
        f"Residuals of the calibrated arm, averaged over {len(found[0].middle)} groups of readings along each factor, "
        "with two sigma of each average. Pure noise stays near zero everywhere; a wave along a joint is physics that "
        "the model lacks."
    )


def _pattern_table(found: tuple[Pattern, ...]) -> Html:
    rows = [
        (
            p.factor,
            fixed(p.f, 2),
            significant(p.p, 2) if p.p > 0.0 else "0",
            f"{p.share:.0%}",
            "a pattern" if p.clear else "chance",
        )
        for p in found
    ]
    caption = f"Dependence of the residuals on each factor (one-way analysis of variance, up to {GROUPS} groups)"
    head = ("Factor", "F", "p", "share of the residuals", "result")
    return folded("The same in numbers", table(head, rows, numeric=(1, 2, 3), caption=caption), on_paper=False)
