"""The chapter with the paper's four-pose point constraint, beside the full identification."""

from collections.abc import Sequence
from math import degrees, hypot

from calibrate.report.elements import Html, figure, panels, section, table, tag
from calibrate.report.quantities import decimals_of, fixed, length, significant
from calibrate.report.rank_figures import spectrum
from calibrate.report.reasons import plain_reason
from calibrate.report.sections.zeros import rank_words
from calibrate.zeros.point_constraint import PointConstraintResult
from calibrate.zeros.result import JointZero

TITLE = "Four-pose point constraint"
LEAD = (
    "The method of Deng, Ding, Zhang (Food & Machinery 2019(3)), for comparison: the laser lines of centred poses meet "
    "in one point of the fixture; only joint zeros are unknown."
)


def point(result: PointConstraintResult | None, full: Sequence[JointZero], why_not: str) -> Html:
    """Rank, then zeros beside those of the full model; without a result the reason."""
    if result is None:
        return section("point", TITLE, LEAD, tag("p", f"Not done: {why_not}."))
    seen = result.identifiability
    caption = "Singular values of the point constraint: few poses see few combinations."
    drawing = figure(spectrum(seen.singular_values, seen.rank, "point-spectrum", with_drawing=False), caption)
    words = tag("div", tag("h3", f"Rank {seen.rank} of {seen.n_free} zeros"), rank_words(seen))
    met = (
        f"The lines miss their common point by {length(result.rms_before_m)} rms before the fit. That almost nothing "
        f"is left after it ({length(result.rms_after_m)}) proves nothing: four poses hardly have more equations than "
        f"unknowns. Fit: {result.status.value}."
    )
    return section("point", TITLE, LEAD, panels(drawing, words), tag("p", met), _beside(result, full))


def _beside(result: PointConstraintResult, full: Sequence[JointZero]) -> Html:
    others = {z.joint: z for z in full}
    rows: list[tuple[str, ...]] = []
    for zero in result.zeros:
        if zero.value_rad is None or zero.sigma_rad is None:
            reason = plain_reason(f"joint{zero.joint}.zero", result.identifiability, zero.why)
            rows.append((f"J{zero.joint}", f"not determined: {reason}"))
            continue
        digits = decimals_of(degrees(zero.sigma_rad))
        rows.append(
            (
                f"J{zero.joint}",
                fixed(degrees(zero.value_rad), digits),
                fixed(degrees(zero.sigma_rad), digits),
                *_difference(zero, others.get(zero.joint)),
            )
        )
    head = ("Joint", "zero (°)", "± sigma (°)", "full model (°)", "difference (°)", "in sigma of both")
    return table(head, rows, numeric=(1, 2, 3, 4, 5))


def _difference(zero: JointZero, other: JointZero | None) -> tuple[str, ...]:
    if other is None or other.value_rad is None or other.sigma_rad is None:
        return ("not determined there",)
    value, sigma = zero.value_rad or 0.0, zero.sigma_rad or 0.0
    apart = value - other.value_rad
    both = hypot(sigma, other.sigma_rad)
    in_sigma = significant(abs(apart) / both, 2) if both > 0.0 else ""
    return (
        fixed(degrees(other.value_rad), decimals_of(degrees(other.sigma_rad))),
        fixed(degrees(apart), decimals_of(degrees(both))),
        in_sigma,
    )
