"""Small probabilities from a few hundred draws: the empirical share, beyond the largest ones a generalised-Pareto tail.

Source: Knijnenburg, Wessels, Reinders, Shmulevich, Fewer permutations, more accurate P-values, Bioinformatics 25, 2009;
moments of excesses: Hosking, Wallis, Technometrics 29(3), 1987.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import genpareto

Floats = NDArray[np.float64]

ENOUGH = 10  # exceedances for an empirical share
TAIL = 0.15  # of the draws make the tail
LEAST = 1e-9  # nothing smaller is claimed


@dataclass(frozen=True)
class Tail:
    """Law of a maximum under the null, from draws (draw,) in any order."""

    drawn: Floats

    def p(self, value: float) -> float:
        """Probability of at least this value."""
        count, above = len(self.drawn), int(np.sum(self.drawn >= value))
        tail = np.sort(self.drawn)[-max(ENOUGH, int(TAIL * count)) :]
        if count == 0 or above >= ENOUGH or not np.all(np.isfinite([value, *tail])):
            return (above + 1) / (count + 1)
        threshold, excess = tail[0], tail[1:] - tail[0]
        mean, variance = float(np.mean(excess)), float(np.var(excess))
        if variance <= 0.0 or mean <= 0.0:
            return (above + 1) / (count + 1)
        # Bounded tails would claim p = 0 just beyond the largest draw: an exponential one is the shortest allowed.
        shape = max(0.0, 0.5 * (1.0 - mean**2 / variance))
        scale = mean * (1.0 - shape)
        beyond = float(genpareto.sf(value - threshold, shape, scale=scale))
        return max(LEAST, len(excess) / count * beyond)
