"""What is determined: rank of the weighted derivative, combinations that no reading sees, and the reasons in words."""

from calibrate.fit.rank.identifiability import STRUCTURAL, WEAK, Identifiability, analyse, combinations_of, plainly
from calibrate.fit.rank.not_determined import in_plain_words, kind_of, plain_reason, reason_among
from calibrate.fit.rank.observability import WELL_CONDITIONED, Observability
from calibrate.fit.rank.unseen_along import analyse_along

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
