"""Intervals and the words for a parameter: a value with its uncertainty, or the reason why there is none."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from calibrate.fit.rank.identifiability import Identifiability
from calibrate.fit.solvers import Fit, Status
from calibrate.model.parameters import Parameter


@dataclass(frozen=True)
class Interval:
    """One parameter; all three numbers are None where `why` states that the data do not determine it."""

    name: str
    unit: str
    value: float | None
    sigma: float | None
    low: float | None
    high: float | None
    why: str | None


def intervals(fit: Fit, seen: Identifiability, level: float = 0.95) -> tuple[Interval, ...]:
    """Of all parameters, in order, under the stated noise (normal law).

    `seen`: at the fit, before anything was held; best from `analyse_along`, which misses no bent combination.
    """
    reach = float(ndtri(0.5 + level / 2.0))
    out: list[Interval] = []
    for i, p in enumerate(fit.parameters):
        variance = float(fit.covariance[i, i])
        why = _why_not(fit, seen, p, variance)
        if why is not None:
            out.append(Interval(p.name, p.unit, None, None, None, None, why))
            continue
        value, sigma = float(fit.theta[i]), float(np.sqrt(variance))
        out.append(Interval(p.name, p.unit, value, sigma, value - reach * sigma, value + reach * sigma, None))
    return tuple(out)


def _why_not(fit: Fit, seen: Identifiability, p: Parameter, variance: float) -> str | None:
    unseen = seen.reason(p.name)
    if unseen is not None:
        return unseen
    if not p.free:
        return "held at its nominal value"
    if p.name in fit.at_bound:
        return "at its bound: no result"
    if fit.at_bound:
        return f"{', '.join(fit.at_bound)} ran into the bound: these data do not answer the question"
    if fit.status is not Status.CONVERGED or not np.isfinite(variance):
        return fit.status.value
    if not np.isfinite(p.prior) and np.sqrt(variance) > p.plausible:
        return f"data too weak: sigma {np.sqrt(variance):.2g} {p.unit} is worse than a guess ({p.plausible:g} {p.unit})"
    return None
