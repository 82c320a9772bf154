"""Shares with their uncertainty: Wilson, J. Am. Stat. Assoc. 22, 1927; the level also holds for shares near 0 and 1."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest

LEVEL = 0.95
NO_BREAK = "\u00a0"
TO = "\u2011"  # a hyphen at which no line ends


@dataclass(frozen=True)
class Share:
    """k of n."""

    k: int
    n: int

    @property
    def value(self) -> float:
        return self.k / self.n if self.n else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval; (0, 1) where n is 0."""
        if not self.n:
            return (0.0, 1.0)
        found = binomtest(self.k, self.n).proportion_ci(LEVEL, method="wilson")
        return (float(found.low), float(found.high))

    @property
    def brief(self) -> str:
        """Without n; each half stays together where a line is short."""
        if not self.n:
            return "-"
        low, high = self.interval
        return f"{100 * self.value:.0f}{NO_BREAK}% ({100 * low:.0f}{TO}{100 * high:.0f})"

    def __str__(self) -> str:
        return self.brief if not self.n else f"{self.brief[:-1]}, n{NO_BREAK}{self.n})"


def share(hits: Iterable[bool]) -> Share:
    """How many are true."""
    counted = list(hits)
    return Share(sum(counted), len(counted))
