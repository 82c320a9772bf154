"""What is determined: rank of the weighted derivative, combinations that no reading sees, and the reasons in words."""

from calibrate.fit.rank.identifiability import STRUCTURAL, WEAK, Identifiability, analyse, combinations_of, plainly
from calibrate.fit.rank.observability import (
    WELL_CONDITIONED,
    Observability,
    analyse_along,
    in_plain_words,
    kind_of,
    plain_reason,
    reason_among,
)

__all__ = [
    "STRUCTURAL",
    "WEAK",
    "WELL_CONDITIONED",
    "Identifiability",
    "Observability",
    "analyse",
    "analyse_along",
    "combinations_of",
    "in_plain_words",
    "kind_of",
    "plain_reason",
    "plainly",
    "reason_among",
]
