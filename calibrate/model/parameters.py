"""Named unknowns of a model: unit, start value, prior, plausible size."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """One unknown. Values are corrections to the nominal rig, so that nominal is zero unless `start` is another."""

    name: str  # "joint3.zero"
    unit: str  # "rad", "m" or "1"
    plausible: float  # size of deviation to be expected; scales the column, and a worse sigma is "not determined"
    start: float = 0.0
    prior: float = math.inf  # one sigma about `start`; inf = no opinion
    lower: float = -math.inf
    upper: float = math.inf
    free: bool = True
    assumed: bool = False  # the prior is nobody's statement: it holds a fit, but a number has to come from data

    def __post_init__(self) -> None:
        if not (math.isfinite(self.plausible) and self.plausible > 0.0):
            raise ValueError(f"parameter {self.name}: plausible size {self.plausible} is not a positive number")
        if not self.prior > 0.0:
            raise ValueError(
                f"parameter {self.name}: prior sigma {self.prior} is not positive; use free=False to hold it"
            )
        if not self.lower < self.upper:
            raise ValueError(f"parameter {self.name}: lower bound {self.lower} is not below upper bound {self.upper}")


def start_values(parameters: Iterable[Parameter]) -> Floats:
    """(param,) start values in the order of the parameters."""
    return np.array([p.start for p in parameters], dtype=float)


def priors(parameters: Iterable[Parameter]) -> Floats:
    """(param,) prior sigmas, inf where there is no opinion."""
    return np.array([p.prior for p in parameters], dtype=float)


def plausible_sizes(parameters: Iterable[Parameter]) -> Floats:
    """(param,) sizes of deviation to be expected."""
    return np.array([p.plausible for p in parameters], dtype=float)


def index_of(parameters: Iterable[Parameter]) -> dict[str, int]:
    """Name to column."""
    return {p.name: i for i, p in enumerate(parameters)}


def hold(parameters: Iterable[Parameter], names: Iterable[str]) -> tuple[Parameter, ...]:
    """The same parameters with these held at their start. KeyError for an unknown name."""
    held = set(names)
    out = tuple(replace(p, free=False) if p.name in held else p for p in parameters)
    unknown = held - {p.name for p in out}
    if unknown:
        raise KeyError(f"no parameter named {', '.join(sorted(unknown))}; known: {', '.join(p.name for p in out)}")
    return out


def without_assumed(parameters: Iterable[Parameter]) -> tuple[Parameter, ...]:
    """The same parameters without the priors that nobody stated: what is asked before a number is reported."""
    return tuple(replace(p, prior=math.inf) if p.assumed else p for p in parameters)


def values_by_name(parameters: Iterable[Parameter], values: Mapping[str, float]) -> Floats:
    """(param,) the given values, `start` where a name is not given. KeyError for a name that no parameter has."""
    listed = tuple(parameters)
    unknown = set(values) - {p.name for p in listed}
    if unknown:
        raise KeyError(
            f"no parameter named {', '.join(sorted(unknown))}; this rig has {', '.join(p.name for p in listed)}"
        )
    return np.array([values.get(p.name, p.start) for p in listed], dtype=float)
