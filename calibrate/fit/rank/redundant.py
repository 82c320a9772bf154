"""Parameters that do not change what is measured: taken out before solving, or held by weak priors.

Source: patent CN114523474B (Lu, Shi), step 5: columns that do not change E are removed first. Which columns these are
is the null space of the whitened Jacobian, as `identifiability.analyse` finds it. Either way no member of an unseen
combination has a value to report: `Identifiability.reason` keeps the reason.
"""

from dataclasses import replace
from enum import Enum

from calibrate.fit.rank.identifiability import Identifiability
from calibrate.model.parameters import Parameter


class Redundant(Enum):
    """What is done with a combination that the data do not see."""

    REMOVED = "one member of each unseen combination is held where it starts"
    HELD_BY_PRIORS = "members of unseen combinations are pulled to their start by their plausible size"


def reduced(
    parameters: tuple[Parameter, ...], seen: Identifiability, how: Redundant = Redundant.REMOVED
) -> tuple[Parameter, ...]:
    """The same parameters, in order, such that the data with the priors determine all free ones."""
    if how is Redundant.REMOVED:
        held = {c.representative for c in seen.combinations}
        return tuple(replace(p, free=False) if p.name in held else p for p in parameters)
    members = {name for c in seen.combinations for name in c.members}
    return tuple(replace(p, prior=min(p.prior, p.plausible)) if p.name in members else p for p in parameters)
