"""Laws of an error: a normal, a uniform or a fixed size, or any continuous law of scipy.stats by its name."""

import difflib
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from calibrate.errors import DataError

Floats = NDArray[np.float64]

OWN = ("normal", "uniform", "constant")
CELLS = 1024  # of a table of quantiles; the two outer ones have as many of their own
TAIL = 2.0**-33  # shares beyond are not drawn: some laws are infinite there


@dataclass(frozen=True)
class Law:
    """value = loc + scale X, with X standard normal, uniform in -1 ... 1, one, or of the scipy law `name` and `shape`.

    DataError for a name or shape that scipy.stats does not know, and for a law without a variance.
    """

    name: str
    scale: float
    loc: float = 0.0
    shape: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.loc) and math.isfinite(self.scale) and self.scale >= 0.0):
            raise DataError(
                f"law {self.name}: loc {self.loc}, scale {self.scale}; give finite ones, scale not negative"
            )
        if self.name not in OWN and not isinstance(getattr(stats, self.name, None), stats.rv_continuous):
            raise DataError(f"law '{self.name}' is no continuous law of scipy.stats; {_near(self.name)}")
        if self.name in OWN and self.shape:
            raise DataError(f"law '{self.name}' has no shape; leave shape = {list(self.shape)} out")
        if not math.isfinite(self._standard_variance):
            raise DataError(
                f"law '{self.name}' of shape {list(self.shape)} has no variance: errors cannot be summed up; "
                "take another law, or check the shape"
            )

    @cached_property
    def mean(self) -> float:
        match self.name:
            case "normal" | "uniform":
                return self.loc
            case "constant":
                return self.loc + self.scale
            case _:
                return self.loc + self.scale * float(self._standard.mean())

    @cached_property
    def variance(self) -> float:
        return self.scale**2 * self._standard_variance

    @property
    def square(self) -> float:
        """Mean of the square."""
        return self.mean**2 + self.variance

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """(count,) values; those of a scipy law by linear interpolation between quantiles."""
        match self.name:
            case "normal":
                standard = rng.standard_normal(count)
            case "uniform":
                standard = rng.uniform(-1.0, 1.0, count)
            case "constant":
                standard = np.ones(count)
            case _:
                standard = self._by_table(rng.random(count))
        standard *= self.scale
        standard += self.loc
        return standard

    def quantiles(self, shares: Floats) -> Floats:
        """Values that are exceeded with probability 1 - share."""
        match self.name:
            case "normal":
                standard = stats.norm.ppf(shares)
            case "uniform":
                standard = 2.0 * shares - 1.0
            case "constant":
                standard = np.ones_like(shares)
            case _:
                standard = self._standard.ppf(shares)
        return self.loc + self.scale * np.asarray(standard, dtype=np.float64)

    def _by_table(self, shares: Floats) -> Floats:
        part, at = np.zeros(len(shares), dtype=np.intp), shares * CELLS
        outer = np.flatnonzero(np.abs(at - 0.5 * CELLS) >= 0.5 * CELLS - 1.0)
        high = at[outer] >= 1.0
        part[outer] = 1 + high
        at[outer] = (at[outer] - high * (CELLS - 1)) * CELLS
        cell = at.astype(np.intp)
        below = part * (CELLS + 1) + cell
        low = self.table.ravel()[below]
        at -= cell
        at *= self.table.ravel()[below + 1] - low
        return low + at

    @cached_property
    def table(self) -> Floats:
        """(3, CELLS + 1) quantiles of X: all cells, then the lowest and the highest cell in as many."""
        shares = np.linspace(0.0, 1.0, CELLS + 1)
        each = np.stack([shares, shares / CELLS, 1.0 - (1.0 - shares) / CELLS])
        return np.asarray(self._standard.ppf(np.clip(each, TAIL, 1.0 - TAIL)), dtype=np.float64)

    @cached_property
    def _standard(self) -> Any:
        return getattr(stats, self.name)(*self.shape)

    @property
    def _standard_variance(self) -> float:
        match self.name:
            case "normal":
                return 1.0
            case "uniform":
                return 1.0 / 3.0
            case "constant":
                return 0.0
            case _:
                return self._told_variance()

    def _told_variance(self) -> float:
        try:
            return float(self._standard.var())
        except TypeError as error:
            raise DataError(
                f"law '{self.name}' of shape {list(self.shape)}: {error}; give its shape numbers"
            ) from error


def _near(name: str) -> str:
    known = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous)]
    close = difflib.get_close_matches(name, [*known, *OWN], n=1)
    return f"did you mean '{close[0]}'?" if close else "its documentation lists them; ours: normal, uniform, constant"
