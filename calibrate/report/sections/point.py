"""The chapter with the point constraint, beside the fit, where the fit plan asked for it."""

from collections.abc import Iterator, Sequence
from math import degrees, hypot

from calibrate.fit_plan import BesideName, parse_plan
from calibrate.identification.estimates import JointZero
from calibrate.identification.planned import rig_as_planned
from calibrate.identification.point_constraint import PointConstraintResult, point_constraints
from calibrate.report.elements import Html, bullets, figure, panels, section, table, tag
from calibrate.report.not_determined import in_plain_words, plain_reason, spectrum
from calibrate.report.quantities import decimals_of, fixed, length, significant
from calibrate.report.sections.zeros import zeros_of
from calibrate.report.session_evidence import SessionEvidence

TITLE = "Point constraint"
LEAD = (
    "The method of Deng, Ding, Zhang (Food & Machinery 2019(3)), for comparison: the laser lines of centred poses meet "
    "in one point of the fixture; only joint zeros are unknown. Links and laser are nominal."
)


def asked_for(evidence: SessionEvidence) -> bool:
    """Whether the plan of the model names this method."""
    plan = evidence.model.plan
    return plan is not None and parse_plan(plan, "fit plan in the model").method is BesideName.POINT_CONSTRAINT


def point(evidence: SessionEvidence) -> Html:
    """Both forms, each with its rank and its zeros beside those of the fit."""
    recording, plan = evidence.recording, parse_plan(evidence.model.plan or "", "fit plan in the model")
    found = point_constraints(rig_as_planned(recording.rig, plan), recording.samples.take(evidence.rows))
    full = zeros_of(evidence)
    return section(
        "point",
        TITLE,
        LEAD,
        tag("h3", f"Four poses at place {found.placement}, as published"),
        *_one(found.four_poses, full, "four"),
        tag("h3", f"All {found.poses} centred poses at place {found.placement}"),
        *_one(found.all_poses, full, "all"),
    )


def _one(result: PointConstraintResult, full: Sequence[JointZero], name: str) -> Iterator[Html]:
    seen = result.identifiability
    caption = "Singular values of the point constraint: few poses see few combinations."
    drawing = figure(spectrum(seen.singular_values, seen.rank, f"point-{name}", with_drawing=False), caption)
    words = [tag("h3", f"Rank {seen.rank} of {seen.n_free} zeros")]
    if seen.combinations:
        words.append(bullets(in_plain_words(c.words) for c in seen.combinations))
    yield panels(drawing, tag("div", *words))
    yield tag(
        "p",
        f"The lines miss their common point by {length(result.rms_distance_before_m)} rms distance before the fit, by "
        f"{length(result.rms_distance_after_m)} after it. Fit: {result.status.value}.",
    )
    yield _beside(result, full)


def _beside(result: PointConstraintResult, full: Sequence[JointZero]) -> Html:
    others = {z.joint: z for z in full}
    rows: list[tuple[str, ...]] = []
    for zero in result.zeros:
        if zero.value_rad is None or zero.sigma_rad is None:
            reason = plain_reason(f"joint{zero.joint}.zero", result.identifiability, zero.why)
            rows.append((f"J{zero.joint}", f"not determined: {reason}"))
            continue
        digits = decimals_of(degrees(zero.sigma_rad))
        value, sigma = fixed(degrees(zero.value_rad), digits), fixed(degrees(zero.sigma_rad), digits)
        rows.append((f"J{zero.joint}", value, sigma, *_difference(zero, others.get(zero.joint))))
    head = ("Joint", "zero (°)", "± sigma (°)", "by the fit (°)", "difference (°)", "in sigma of both")
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
