"""Who else could it be: candidates that could stand in for a finding with everything else refitted.

Weights within the class are those of BIC: Kass, Raftery, Bayes factors, J. Am. Stat. Assoc. 90(430), 1995, section 4.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.growing import proposals
from calibrate.diagnose.search.score import Removed, gain_of, scores
from calibrate.diagnose.search.searching import Key, cause_of, taken
from calibrate.model.effects.curve import is_slow_cause
from calibrate.model.effects.term import Accepted, Term

Floats = NDArray[np.float64]

WARMTH = "temp_"


@dataclass(frozen=True)
class Rival:
    """Another candidate in the place of a finding."""

    accepted: Accepted
    margin: float  # BIC by which the finding is better; negative: the alternative is
    refitted: bool  # margin from a full refit, or from the linear score
    plausible: bool = True  # False: fits better, but is of a size that no machine has

    @property
    def term(self) -> Term:
        return self.accepted.term


def rivals_of(bench: Bench, i: int) -> tuple[Rival, ...]:
    """Of accepted term i: all candidates within 6 BIC, nearest first; sizes that no machine has, only if better."""
    gone, own = bench.gone[i], bench.state.accepted[i].term
    refits = (
        limits.ALTERNATIVE_REFITS
        if len(bench.state.accepted) <= limits.REFITTED_TERMS and bench.state.samples <= limits.REFITTED_SAMPLES
        else 0
    )
    near = _near(bench, gone, gain_of(gone, bench.sight), taken(bench, (i,)) | {cause_of(own)})
    found = [_confirmed(bench, i, r) if rank < refits or r.margin < 0.0 else r for rank, r in enumerate(near)]
    known = [r for r in found if r is not None and r.term.key != own.key]
    kept = [r for r in known if r.margin - _clock_price(bench, own, r.term) <= limits.ALTERNATIVE_WITHIN]
    return tuple(sorted(kept, key=lambda r: r.margin))


def _clock_price(bench: Bench, own: Term, other: Term) -> float:
    """BIC that a time constant costs and a thermometer does not: where temperature follows time, neither is ruled out
    by it (mismatch catalogue, lessons).
    """
    drivers = [term.depends_on[0] for term in (own, other)]
    if len(set(drivers)) != len(drivers) or not all(is_slow_cause(name) for name in drivers):
        return 0.0
    return max(len(other.inner) - len(own.inner), 0) * float(np.log(bench.sight.data))


def price(bench: Bench, term: Term) -> float:
    """BIC that a name costs before any reading: by its odds, and of having picked a thermometer.

    The thermometer at the place itself is free, any other one is one of many. Source: extended BIC, Chen, Chen,
    Biometrika 95(3), 2008, gamma = 1.
    """
    odds = -2.0 * float(np.log(limits.ODDS_WITH_COMPLIANCE.get(term.physics, 1.0)))
    driver, where = term.depends_on[0], term.port.where
    if not driver.startswith(WARMTH) or where.startswith(driver.removeprefix(WARMTH) + "."):
        return odds
    return odds + 2.0 * float(np.log(max(len(bench.state.drivers.temperatures_degC), 1)))


def confidences(bench: Bench, own: Term, rivals: Sequence[Rival]) -> Floats:
    """(1 + alternative,) share of probability of the finding, then of each alternative.

    The name of a finding was chosen among equals for being the simplest (`doubt.py`): such an alternative is as likely,
    not more. A better one of a size that no machine has takes probability from the name and gets none itself.
    """
    margins = np.array([0.0, *(r.margin + price(bench, r.term) - price(bench, own) for r in rivals)])
    named = np.array([True, *(r.plausible for r in rivals)])
    margins = np.where(named, np.maximum(margins, 0.0), margins)
    weights = np.exp(-0.5 * (margins - margins.min()))
    posterior = weights / weights.sum()
    return np.asarray(np.where(named, posterior, np.minimum(posterior, posterior[0])), dtype=np.float64)


def _near(bench: Bench, gone: Removed, worth: float, taken: frozenset[Key]) -> list[Rival]:
    """One of every cause."""
    out: dict[Key, Rival] = {}
    for proposal in proposals(bench, scores(bench.menu, gone), gone, worth - limits.ALTERNATIVE_NEAR, taken):
        own, margin = proposal.accepted, worth - proposal.gain
        plausible = own.term.plausible(own.coefficients, own.inner, bench.noise_rad)
        if plausible or margin < 0.0:
            out.setdefault(cause_of(own.term), Rival(own, margin, refitted=False, plausible=plausible))
    return list(out.values())


def _confirmed(bench: Bench, i: int, rival: Rival) -> Rival | None:
    """None where the refit takes it to a size that no machine has, unless it fits better."""
    accepted = [rival.accepted if j == i else a for j, a in enumerate(bench.state.accepted)]
    trial = Bench(bench.state.refitted(accepted))
    found = trial.state.accepted[i]
    plausible = found.term.plausible(found.coefficients, found.inner, bench.noise_rad)
    margin = trial.bic - bench.bic
    return Rival(found, margin, refitted=True, plausible=plausible) if plausible or margin < 0.0 else None
