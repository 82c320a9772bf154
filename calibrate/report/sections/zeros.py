"""The table of joint zeros with what limits each of them, and the point constraint where the fit plan asked for it."""

from collections.abc import Iterator, Sequence
from math import degrees, hypot

from matplotlib.figure import Figure

from calibrate.fit.fit_plan import MethodName, parse_plan
from calibrate.fit.identify.estimates import Estimate, JointZero, joint_zeros
from calibrate.fit.identify.point_constraint import PointConstraintResult, point_constraints
from calibrate.fit.identify.session import rig_as_planned
from calibrate.fit.rank import in_plain_words, plain_reason, reason_among
from calibrate.model.default_tolerance import links_of
from calibrate.model.sensors import spots
from calibrate.quantities import (
    DASH,
    aligned,
    angle,
    decimals_of,
    fixed,
    length,
    significant,
)
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    panels,
    section,
    table,
    tag,
)
from calibrate.report.elements.svg import drawn, log_axis, spectrum
from calibrate.report.elements.tones import Tone
from calibrate.report.evidence.session_evidence import SessionEvidence
from calibrate.report.workspace.workspace_errors import whole_covariance

ROW_IN = 0.3


def zero_uncertainties(zeros: Sequence[JointZero]) -> Html:
    """Sigma of every determined zero, and what the measurement alone leaves of it."""
    says = "sigma of each joint zero on a logarithmic axis, in all and of the measurement alone"
    return drawn("zero-doubts", says, 4.8, 1.0 + ROW_IN * len(zeros), lambda figure: _paint_sigmas(figure, zeros))


def _paint_sigmas(figure: Figure, zeros: Sequence[JointZero]) -> None:
    axes = figure.add_subplot()
    alone, total = ("measurement alone", "in all") if zeros else (None, None)
    for row, zero in enumerate(zeros):
        if zero.sigma_rad is None:
            continue
        least = zero.measurement_sigma_rad or zero.sigma_rad
        axes.plot([least, zero.sigma_rad], [row, row], color=Tone.SOFT.value, lw=1.6, zorder=1)
        paper = {"mfc": Tone.PAPER.value, "mec": Tone.PLACE_1.value, "mew": 1.6}
        axes.plot(least, row, "o", ms=6.5, label=alone, **paper)  # pyright: ignore[reportArgumentType]
        axes.plot(zero.sigma_rad, row, "o", ms=7, color=Tone.PLACE_1.value, label=total)
        alone = total = None
    for row, zero in enumerate(zeros):
        if zero.sigma_rad is None:
            axes.annotate(
                "not determined",
                (0.01, row),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=10,
                color=Tone.SOFT.value,
            )
    axes.set_yticks(range(len(zeros)), [f"J{z.joint}" for z in zeros])
    axes.tick_params(axis="y", length=0, colors=Tone.INK.value)
    axes.set_ylim(len(zeros) - 0.5, -0.5)
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    sizes = [s for z in zeros for s in (z.sigma_rad, z.measurement_sigma_rad) if s]
    log_axis(axes, "x", sizes, lambda value: angle(value, 1))
    axes.set_title("One sigma of each zero")
    if any(z.sigma_rad is not None for z in zeros):
        axes.legend(loc="upper right", bbox_to_anchor=(1.0, -0.16), ncols=2, borderaxespad=0.0)


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
            "Uncertainty of each zero, on a logarithmic axis. A long line: more poses will not help; the assumed "
            "tolerance of the links is the limit, because these data do not separate the zero from the links."
        )
        yield figure(zero_uncertainties(zeros), caption)


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
        f"Sigma includes the assumed tolerance of the links ({links.length_sigma_m * 1e3:g} mm, "
        f"{angle(links.angle_sigma_rad)}) where these data do not determine them. “Of measurement alone” "
        "would remain if links and bracket were exactly as fitted."
    )


def _decimals(zero: JointZero) -> int:
    return decimals_of(degrees(zero.sigma_rad or 0.0))


def _alone(zero: JointZero) -> str:
    return DASH if zero.measurement_sigma_rad is None else significant(1e6 * zero.measurement_sigma_rad, 2)


def _names(zeros: Sequence[JointZero]) -> str:
    return ", ".join(f"J{z.joint}" for z in zeros)


def _reason(zero: JointZero, evidence: SessionEvidence) -> str:
    return reason_among(f"joint{zero.joint}.zero", evidence.model.unseen, zero.why)


POINT_TITLE = "Point constraint"
LEAD = (
    "The method of Deng, Ding, Zhang (Food & Machinery 2019(3)), for comparison: the laser lines of centred poses meet "
    "in one point of the fixture; only joint zeros are unknown. Links and laser are nominal."
)


def asked_for(evidence: SessionEvidence) -> bool:
    """Whether the plan of the model names this method."""
    plan = evidence.model.plan
    return plan is not None and parse_plan(plan, "fit plan in the model").method is MethodName.POINT_CONSTRAINT


def point(evidence: SessionEvidence) -> Html:
    """Both forms, each with its rank and its zeros beside those of the fit."""
    recording, plan = evidence.recording, parse_plan(evidence.model.plan or "", "fit plan in the model")
    found = point_constraints(rig_as_planned(recording.rig, plan), recording.samples.take(evidence.rows))
    full = zeros_of(evidence)
    return section(
        "point",
        POINT_TITLE,
        LEAD,
        tag("h3", f"Four poses at station {found.placement}, as published"),
        *_one(found.four_poses, full, "four"),
        tag("h3", f"All {found.poses} centred poses at station {found.placement}"),
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
    yield _point_constraint_block(result, full)


def _point_constraint_block(result: PointConstraintResult, full: Sequence[JointZero]) -> Html:
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
