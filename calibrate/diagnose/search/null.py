"""How large the best gain of a whole catalogue gets when there is nothing: the price of searching.

The maximum over all candidates is drawn, so the multiplicity of hundreds of correlated ones is paid (family-wise
error). Source: Westfall, Young, Resampling-based multiple testing, 1993, ch. 2. Slow terms are a family of their own:
where the noise wanders, theirs is the gain over a wander fitted to what remains, before and after.

Small probabilities from a few hundred draws: the empirical share, beyond the largest ones a generalised-Pareto tail.

Source: Knijnenburg, Wessels, Reinders, Shmulevich, Fewer permutations, more accurate P-values, Bioinformatics 25, 2009;
moments of excesses: Hosking, Wallis, Technometrics 29(3), 1987.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import inv_boxcox

from calibrate.diagnose.search import limits
from calibrate.diagnose.search.noise_law import NoiseLaw
from calibrate.diagnose.search.score import (
    Removed,
    bic_gain,
    directions,
    turned_out,
)
from calibrate.diagnose.state.visible import Menu, Sight
from calibrate.model.effects.term import Term

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Tail:
    """Law of a maximum under the null, from draws (draw,) in any order."""

    drawn: Floats

    def p(self, value: float) -> float:
        """Probability of at least this value."""
        count, above = len(self.drawn), int(np.sum(self.drawn >= value))
        tail = np.sort(self.drawn)[-max(limits.TAIL_ENOUGH, int(limits.TAIL_SHARE * count)) :]
        if count == 0 or above >= limits.TAIL_ENOUGH or not np.all(np.isfinite([value, *tail])):
            return (above + 1) / (count + 1)
        threshold, excess = tail[0], tail[1:] - tail[0]
        mean, variance = float(np.mean(excess)), float(np.var(excess))
        if variance <= 0.0 or mean <= 0.0:
            return (above + 1) / (count + 1)
        # Bounded tails would claim p = 0 just beyond the largest draw: an exponential one is the shortest allowed.
        shape = max(0.0, 0.5 * (1.0 - mean**2 / variance))
        scale = mean * (1.0 - shape)
        beyond = float(inv_boxcox((threshold - value) / scale, -shape))  # generalised Pareto
        return max(limits.LEAST_P, len(excess) / count * beyond)


Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Null:
    """Law of the best gain of either family without any effect."""

    fast: Tail
    slow: Tail
    law: NoiseLaw

    def p(self, sight: Sight, slow: bool, gain: float, span: Floats, cost: int) -> float:
        """Family-wise probability that nothing at all gives a candidate that gains so much; its directions behind
        geometry are span (k, row), `cost` parameters are paid for.
        """
        if not slow:
            return min(1.0, limits.FAMILIES * self.fast.p(gain))
        if self.law.wanders:
            left = sight.residual[:, None]
            after = left - span.T @ (span @ left)
            gain = float(_beyond_wander(self.law, left, after, np.array([cost]), sight.data)[0])
        return self._of_slow(gain)

    def p_of_worth(self, slow: bool, sight: Sight, gone: Removed) -> float:
        """The same of what a model holds already: what comes back when it is taken out.

        Weights that a term has tuned make it look larger than it scored among draws: the law's curvature undoes that.
        """
        part = self.law.curvature * gone.part
        if slow and self.law.wanders:
            before = sight.residual + gone.span @ part
            gained = self.law.gain(before[:, None], sight.residual[:, None])
            gain = float(gained[0]) - gone.cost * float(np.log(sight.data))
        else:
            squares = float(part @ part)
            gain = float(bic_gain(np.array(squares), sight.rss + squares, np.array(gone.cost), sight.data))
        return self._of_slow(gain) if slow else min(1.0, limits.FAMILIES * self.fast.p(gain))

    def _of_slow(self, gain: float) -> float:
        """Against a wander the price of the second family is not asked for again: the law overstates the wander."""
        return min(1.0, (1 if self.law.wanders else limits.FAMILIES) * self.slow.p(gain))


def is_slow(term: Term) -> bool:
    """A function of time, or of what changes with it."""
    return term.slow or any(name == "t" or name.startswith("temp_") for name in term.depends_on)


def null_of(menu: Menu, law: NoiseLaw, rng: Generator, draws: int = limits.NULL_DRAWS) -> Null:
    """Draws noise, lets geometry absorb its part and scores every entry of the menu."""
    noise = law.draw(rng, draws)
    left = noise - menu.sight.basis @ (menu.sight.basis.T @ noise)
    gains = gains_of(menu, left)
    slow = menu.of_terms(np.array([is_slow(term) for term in menu.terms], dtype=bool))
    fast = np.max(gains[~slow], axis=0, initial=-np.inf)
    return Null(Tail(fast), Tail(_slow_maxima(menu, law, left, gains, slow)), law)


def gains_of(menu: Menu, left: Floats) -> Floats:
    """(entry, draw) of residuals (row, draw) that geometry has left."""
    rss, gains = np.sum(left**2, axis=0), np.full((len(menu.entries), left.shape[1]), -np.inf)
    for block in menu.blocks:
        turn = turned_out(block)
        squares = np.sum((turn @ block.products(left)) ** 2, axis=1)
        rank = np.sum(np.any(turn != 0.0, axis=2), axis=1)
        gain = bic_gain(squares, rss, (rank + menu.numbers[block.entries])[:, None], menu.sight.data)
        gains[block.entries] = np.where(rank[:, None] > 0, gain, -np.inf)
    return gains


def _slow_maxima(menu: Menu, law: NoiseLaw, left: Floats, gains: Floats, slow: Bools) -> Floats:
    if not slow.any():
        return np.zeros(0)
    if not law.wanders:
        return np.max(gains[slow], axis=0)
    best, after, cost = np.flatnonzero(slow)[np.argmax(gains[slow], axis=0)], left.copy(), np.zeros(left.shape[1])
    for entry in np.unique(best):
        span, mine = directions(menu, int(entry)), best == entry
        after[:, mine] -= span.T @ (span @ left[:, mine])
        cost[mine] = len(span) + menu.numbers[entry]
    return _beyond_wander(law, left, after, cost, menu.sight.data)


def _beyond_wander(law: NoiseLaw, left: Floats, after: Floats, cost: Floats, data: int) -> Floats:
    """(draw,) BIC gain if noise (row, draw) wanders as fits best with and without directions; `after` is what these
    leave of it, `cost` (draw,) parameters are paid for.
    """
    return law.gain(left, after) - cost * float(np.log(data))
