"""Duels between what was found and what it could also be, at the measured poses and at others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.assess.diagnosis import Diagnosis, Named
from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.assess.missing_columns import separated_by_time
from calibrate.diagnose.new_poses.longer_session import LongerSession, NewPoses, at_new_poses
from calibrate.diagnose.new_poses.next_poses import Contest, Duel, next_poses, reach_of
from calibrate.diagnose.new_poses.reachable import reachable
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.score import scores
from calibrate.diagnose.state.fitted import Fitted
from calibrate.model.effects.term import Accepted
from calibrate.model.sensors import spots

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class NextPoses:
    """Poses that separate alternatives, in the order of choice, and what they separate."""

    poses: NewPoses
    spots_m: Floats  # (pose, 4) expected on two detectors, NaN where there are none
    pairs: tuple[tuple[Named, Named], ...]  # finding, alternative
    before: float  # BIC margin to expect of the closest pair, from what is measured
    after: float  # and with these poses


def separating(diagnosis: Diagnosis, rng: Generator, count: int = limits.NEW_POSES) -> NextPoses | None:
    """The poses to take next; None where no finding has an alternative, or where no pose separates them."""
    state = diagnosis.model
    if not isinstance(state, Fitted):
        raise TypeError(f"a diagnosis of {type(state).__name__}, which is no fit to a recording")
    rivals = _rivals(state, diagnosis)
    if not rivals:
        return None
    offered = reachable(state, rng)
    there, pairs, duels = at_new_poses(state, offered), list[tuple[Named, Named]](), list[Duel]()
    for i, rival in rivals:
        found = duel(there, i, rival)
        if found is not None and reach_of(found) > limits.SEPARABLE:
            duels.append(found)
            pairs.append((named(state.accepted[i].term), named(rival.term)))
    if not duels:
        return None
    chosen = next_poses(duels, count)
    before, after = float(chosen.separation[0]), float(chosen.separation[-1])
    return NextPoses(offered.take(chosen.poses), _spots(there)[chosen.poses], tuple(pairs), before, after)


def duel(there: LongerSession, i: int, rival: Accepted) -> Duel | None:
    """Of accepted term i and an alternative in its place; None where a term knows the measured poses only."""
    own, against = there.carried(there.state.accepted[i]), there.carried(rival)
    others = [there.carried(a) for j, a in enumerate(there.state.accepted) if j != i]
    if own is None or against is None:
        return None
    measured, new = there.fitted_along([*(a for a in others if a is not None), against])
    adds, adds_new = there.added(own)
    prior_rows = np.zeros(len(measured) - len(adds))
    return Duel(measured, np.concatenate([adds, prior_rows]), Contest(adds_new, new))


def rival_named(state: Fitted, i: int, name: Named) -> Accepted | None:
    """The best term of a name in the place of accepted term i, everything else refitted; None if there is none."""
    bench = Bench(state)
    gone, menu = bench.gone[i], bench.menu
    gain = scores(menu, gone).gain
    mine = [e for e, entry in enumerate(menu.entries) if named(menu.terms[entry.term]) == name]
    if not mine:
        return None
    best = menu.entries[max(mine, key=lambda e: float(gain[e]))]
    return refined(bench, menu.terms[best.term], best.inner, gone)


def _spots(there: LongerSession) -> Floats:
    n = len(there.state.session.samples)
    out = np.full((len(there.session.samples) - n, 4), np.nan)
    for m, expected in zip(there.session.measured, there.around.expected, strict=True):
        if m.name == spots.KIND.name:
            sample = m.sample_rows[:, -1]
            out[sample[sample >= n] - n] = expected[sample >= n]
    return out


def _rivals(state: Fitted, diagnosis: Diagnosis) -> Sequence[tuple[int, Accepted]]:
    out: list[tuple[int, Accepted]] = []
    for finding in diagnosis.findings:
        at = [i for i, a in enumerate(state.accepted) if named(a.term) == finding.name]
        for rival in finding.rivals if at else ():
            if separated_by_time(finding.name, rival.name):
                continue
            found = rival_named(state, at[0], rival.name)
            if found is not None:
                out.append((at[0], found))
    return out
