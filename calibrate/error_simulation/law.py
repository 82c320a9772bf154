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
from calibrate.kernels.perturbed import CELLS, CONSTANT, NORMAL, TABLE, TAIL, UNIFORM

Floats = NDArray[np.float64]

OWN = {"normal": NORMAL, "uniform": UNIFORM, "constant": CONSTANT}


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

    @property
    def columns(self) -> tuple[int, float, float]:
        """Law, loc and scale of a column of calibrate/kernels/perturbed.py, which draws uniforms in 0 ... 1."""
        if self.name == "uniform":
            return UNIFORM, self.loc - self.scale, 2.0 * self.scale
        if self.name == "constant":
            return CONSTANT, self.loc + self.scale, 0.0
        return OWN.get(self.name, TABLE), self.loc, self.scale

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
