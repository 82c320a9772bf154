"""Sources of error: one number that is drawn for every arm, where it acts, and its distribution.

A distribution is a normal, a uniform or a fixed size, or any continuous one of scipy.stats by its name. What a shaft
off its axis or a bearing out of round does repeats with the joint's angle, from a phase that is not known: such a
source draws its phase evenly beside its size. With the columns C = A cos f, S = A sin f of a size A and a phase f, A
sin(k q + f) = C sin k q + S cos k q, A cos(k q + f) = C cos k q - S sin k q: linear in both columns.
"""

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
                return self._stated_variance()

    def _stated_variance(self) -> float:
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


@dataclass(frozen=True)
class Wave:
    """sin(order q_joint + phase), or its cosine."""

    joint: int  # from 0
    order: float
    cosine: bool = False


@dataclass(frozen=True)
class SourceTerm:
    """What a source adds to a slot: weight times its value, times the wave where there is one."""

    slot: int
    weight: float = 1.0
    wave: Wave | None = None

    def weights(self, q_rad: Floats) -> Floats:
        """(pose, 2) of the columns C and S; of a term without a wave the first alone counts."""
        out = np.zeros((len(q_rad), 2))
        if self.wave is None:
            out[:, 0] = self.weight
            return out
        angle = self.wave.order * q_rad[:, self.wave.joint]
        c, s = np.cos(angle), np.sin(angle)
        out[:, 0], out[:, 1] = (c, -s) if self.wave.cosine else (s, c)
        return self.weight * out


@dataclass(frozen=True)
class ErrorSource:
    """`terms` either all have a wave or none."""

    name: str  # "link2.x"
    group: str  # line of the error budget: "link lengths"
    unit: str  # "m", "rad" or "K", of the law
    law: Law
    terms: tuple[SourceTerm, ...]

    @property
    def phased(self) -> bool:
        """Whether a phase is drawn, too."""
        return self.terms[0].wave is not None

    @property
    def moments(self) -> tuple[Floats, Floats]:
        """Means (column,) and variances (column,) of the source's columns: one, or C and S."""
        if self.phased:  # even phases: no mean, half of the square each, no covariance
            return np.zeros(2), np.full(2, self.law.square / 2.0)
        return np.array([self.law.mean]), np.array([self.law.variance])

    def by_column(self, by_slot: Floats, q_rad: Floats) -> Floats:
        """(pose, 3, column) derivative of the probe by the columns, from that by slots (pose, 3, slot)."""
        out = np.zeros((len(q_rad), 3, 2))
        for term in self.terms:
            out += by_slot[:, :, term.slot, None] * term.weights(q_rad)[:, None, :]
        return out if self.phased else out[..., :1]
