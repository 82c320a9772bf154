"""Steps that robust weights have swallowed: shots at a fixture that stood elsewhere for a while look like wild rows.

Trusted again, they propose the step; it stays where a robust refit leaves no doubt.
"""

from dataclasses import replace

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.growing import admissible
from calibrate.diagnose.pruning import p_of
from calibrate.diagnose.score import gain_of
from calibrate.diagnose.searching import SURE_SLOW, Search, null_at
from calibrate.effects.term import Shape
from calibrate.effects.time_laws import FEWEST_AFTER


def unswallowed(at: Search) -> Search | None:
    """With the best step for rows that nobody trusts; None if there are few of them, or no step explains them."""
    if at.state.distrusted < FEWEST_AFTER:
        return None
    trusting = at.state.trusting()
    steps = tuple(t for t in trusting.candidates() if t.shape is Shape.STEP and not t.open)
    bench = Bench(trusting, Bench(trusting).menu_of(steps))
    proposed = admissible(bench, bench.scores, None, 0.0, at.causes | at.banned)
    if proposed is None:
        return None
    trial = Bench(at.state.refitted((*at.state.accepted, proposed.accepted)))
    if trial.bic >= at.bench.bic or not trial.plausible[-1]:
        return None
    # Picked for its wild rows, so the null, which has none, is no judge: heavy tails make such steps, too.
    if gain_of(trial.gone[-1], trial.sight) < SURE_SLOW:
        return None
    p = p_of(trial, null_at(trial, at.rng), len(trial.state.accepted) - 1)
    return replace(at.at(trial), p=at.p | {proposed.term.key: p})
