"""Rows that a fit has not seen, predicted from the others: one line a split and instrument."""

from collections.abc import Sequence

from calibrate.model_file import UnseenRows
from calibrate.report.elements import Html, table, tag
from calibrate.report.quantities import DASH, angle, fixed, length
from calibrate.sensors.catalogue import kind_of


def unseen_rows(found: Sequence[UnseenRows], unproven: Sequence[str]) -> list[Html]:
    """A table, or a sentence where nothing was kept out; then why a split proves nothing."""
    reasons = [tag("p", f"No proof by {why}.") for why in unproven]
    if not found:
        return [tag("p", "No rows were kept out of the fit: too few, or it was not asked for."), *reasons]
    head = (
        "Left out",
        "reading",
        "count",
        "nominal, rms distance",
        "identified, rms distance",
        "over the noise",
        "over noise and sigmas",
    )
    caption = "Rows that the fit has not seen, predicted from the others"
    return [table(head, (_proof(p) for p in found), numeric=(2, 3, 4, 5, 6), caption=caption), *reasons]


def _proof(proof: UnseenRows) -> tuple[str, ...]:
    kind = kind_of(proof.instrument)
    says = angle if kind.quantities[0].unit == "rad" else length
    return (
        proof.split,
        kind.title,
        str(proof.observations),
        says(proof.rms_distance_before_m),
        says(proof.rms_distance_after_m),
        fixed(proof.chi_after, 2),
        DASH if proof.chi_predicted is None else fixed(proof.chi_predicted, 2),
    )
