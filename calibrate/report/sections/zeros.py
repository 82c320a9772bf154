"""The chapter with the full table of zeros and the rank that stands before it."""

from collections.abc import Iterator, Sequence
from math import degrees

import numpy as np

from calibrate.default_belief import links_of, said_of
from calibrate.identifiability import WEAK, Identifiability
from calibrate.parameters import Parameter
from calibrate.report.elements import Html, bullets, figure, folded, join, panels, section, table, tag
from calibrate.report.evidence import Evidence
from calibrate.report.quantities import DASH, aligned, angle, decimals_of, fixed, significant
from calibrate.report.rank_figures import spectrum
from calibrate.report.reasons import kind_of, plain_reason
from calibrate.zeros.result import Estimate, JointZero

TITLE = "Joint zeros and rank"
LEARNED = 0.9  # sigma over drawing tolerance: above, these data taught nothing about the parameter


def zeros(evidence: Evidence) -> Html:
    """Rank first, then numbers, then every parameter for who wants it."""
    result, seen = evidence.result, evidence.result.identifiability
    lead = (
        f"Rank {seen.rank} of {seen.n_free}: what the data can see comes before any number. Fit: {result.status.value}."
    )
    return section(
        "zeros",
        TITLE,
        lead,
        panels(
            figure(
                spectrum(seen.singular_values, seen.rank, "spectrum"),
                "Singular values of the weighted Jacobian. Each says how many times better than a plausible guess one "
                "combination of parameters is known. The drop below the dashed line is the rank gap.",
            ),
            tag("div", tag("h3", "Unseen combinations"), rank_words(seen)),
        ),
        tag("h3", "Zeros"),
        table_of_zeros(result.zeros, seen),
        tag("p", _reading(evidence), cls="lead"),
        folded(f"All {len(result.estimates)} parameters", _parameters(evidence)),
    )


def rank_words(seen: Identifiability) -> Html:
    """Unseen combinations in words, and the gap in numbers."""
    s, rank = seen.singular_values, seen.rank
    said = [
        tag(
            "p",
            f"{rank} of {seen.n_free} combinations are seen; the largest singular value is {significant(float(s[0]))}.",
        )
    ]
    if 0 < rank < len(s):
        seen_last, unseen_first = significant(float(s[rank - 1])), significant(float(s[rank]), 2)
        gap = f"The smallest seen is {seen_last}, the largest unseen {unseen_first}; the limit is {WEAK:g}."
        said.append(tag("p", gap))
    if not seen.combinations:
        return join(*said, tag("p", "Every parameter can be told from every other."))
    return join(*said, bullets(join(tag("code", c.words), f": {kind_of(c)}.") for c in seen.combinations))


def table_of_zeros(listed: Sequence[JointZero], seen: Identifiability) -> Html:
    """Value, sigma, sigma of the measurement alone; never a number without the right to it."""
    known = [z for z in listed if z.value_rad is not None and z.sigma_rad is not None]
    columns = [
        aligned([fixed(scale(z.value_rad or 0.0), decimals_of(scale(z.sigma_rad or 0.0))) for z in known])
        for scale in (degrees, _mrad)
    ]
    sigmas = [
        aligned([fixed(scale(z.sigma_rad or 0.0), decimals_of(scale(z.sigma_rad or 0.0))) for z in known])
        for scale in (degrees, _mrad)
    ]
    alone = aligned([_alone(z) for z in known])
    numbers = {
        z.joint: (columns[0][i], sigmas[0][i], columns[1][i], sigmas[1][i], alone[i]) for i, z in enumerate(known)
    }
    rows = [(f"J{z.joint}", *numbers.get(z.joint, (f"not determined: {_why(z, seen)}",))) for z in listed]
    head = ("Joint", "zero (°)", "± sigma (°)", "zero (mrad)", "± sigma (mrad)", "of measurement alone (µrad)")
    return table(head, rows, numeric=(1, 2, 3, 4, 5))


def _mrad(value_rad: float) -> float:
    return 1e3 * value_rad


def _alone(zero: JointZero) -> str:
    return DASH if zero.measurement_sigma_rad is None else significant(1e6 * zero.measurement_sigma_rad, 2)


def _why(zero: JointZero, seen: Identifiability) -> str:
    return plain_reason(f"joint{zero.joint}.zero", seen, zero.why)


def _reading(evidence: Evidence) -> str:
    rig = evidence.recording.rig
    links, unasked = links_of(rig), said_of(rig)
    return (
        ("" if unasked is None else f"The rig file has {unasked}. ")
        + f"Sigma holds what the links may be off the drawing ({links.length_sigma_m * 1e3:g} mm, "
        f"{angle(links.angle_sigma_rad)}) as far as the data do not tell. The last column is what would remain "
        "if links and bracket were exactly as now fitted."
    )


def _parameters(evidence: Evidence) -> Html:
    result = evidence.result
    head = ("Parameter", "correction", "± sigma", "unit", "tolerance", "known from")
    rows = _parameter_rows(result.estimates, {p.name: p for p in result.parameters}, result.identifiability)
    return table(head, rows, numeric=(1, 2, 4))


def _parameter_rows(
    estimates: Sequence[Estimate], parameters: dict[str, Parameter], seen: Identifiability
) -> Iterator[tuple[str, ...]]:
    for e in estimates:
        name = tag("code", e.name)
        if e.value is None or e.sigma is None:
            yield (
                name,
                f"not determined: {plain_reason(e.name, seen, e.why)}" if parameters[e.name].free else e.why or "held",
            )
            continue
        prior = parameters[e.name].prior
        scale, unit = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}.get(e.unit, (1.0, e.unit))
        digits = decimals_of(scale * e.sigma)
        tolerance = significant(prior * scale) if np.isfinite(prior) else "none"
        source = "data" if e.sigma < LEARNED * prior else "drawing"
        yield (name, fixed(scale * e.value, digits), fixed(scale * e.sigma, digits), unit, tolerance, source)
