"""What may be reported of each parameter: a value with its uncertainty, or the reason why there is none."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.rank.identifiability import Identifiability
from calibrate.fit.solvers import Fit, Status
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]

ONLY_ASSUMED = "known from its assumed tolerance only"
UNSTATED = "assumed for want of a [tolerance]"
HELD = "held so that a combination has an answer; see the combinations"


@dataclass(frozen=True)
class Estimate:
    """One parameter: a value with its uncertainty, or the reason why there is none (then both numbers are None)."""

    name: str
    unit: str
    value: float | None
    sigma: float | None  # one sigma; widened where the noise itself is poorly known, so that 3 sigma keeps its odds
    why: str | None  # why not determined


@dataclass(frozen=True)
class JointZero:
    """Zero of one joint: true angle = reading + value."""

    joint: int  # counted from 1
    value_rad: float | None
    sigma_rad: float | None
    measurement_sigma_rad: float | None  # what would remain of sigma if links and bracket were exactly as now fitted
    why: str | None  # why not determined


def assumed_size(p: Parameter) -> str:
    """Its prior in mm or mrad, one sigma."""
    return f"± {1e3 * p.prior:.3g} m{p.unit}" if p.unit in ("m", "rad") else f"± {p.prior:.3g} {p.unit}"


def undetermined_why(p: Parameter, seen: Identifiability) -> str | None:
    """Why the rank forbids a number for a parameter, None if it does not."""
    why = seen.reason(p.name)
    return why if why is None or not p.assumed else f"{ONLY_ASSUMED}: {assumed_size(p)}, {UNSTATED}; {why}"


def estimate_of(p: Parameter, value: float, sigma: float, fit: Fit, unseen: str | None) -> Estimate:
    """The value with its sigma, or why there is none; `unseen`: what the identifiability states of the parameter."""
    why = unseen
    if not p.free:
        why = "held at its nominal value"
    elif p.name in fit.at_bound:
        why = f"at its bound ({value:g} {p.unit}): no result"
    elif fit.status in (Status.NOT_FINITE, Status.OUT_OF_STEPS, Status.STALLED) or not np.isfinite(sigma):
        why = fit.status.value
    elif why is None and sigma > p.plausible * (1.0 + 1e-6) and not np.isfinite(p.prior):
        why = f"data too weak: sigma {sigma:.2g} {p.unit} is worse than a guess ({p.plausible:g} {p.unit})"
    known = why is None
    return Estimate(p.name, p.unit, value if known else None, sigma if known else None, why)


def joint_zeros(
    estimates: Iterable[Estimate], parameters: tuple[Parameter, ...], covariance: Floats
) -> tuple[JointZero, ...]:
    """The zeros among the estimates; posterior covariance (param, param) of `parameters`, zero where one was held."""
    index = {p.name: i for i, p in enumerate(parameters)}
    variance = np.diag(covariance)
    with_prior = np.flatnonzero([np.isfinite(p.prior) and variance[i] > 0.0 for i, p in enumerate(parameters)])
    found: list[JointZero] = []
    for e in estimates:
        owner, _, what = e.name.partition(".")
        if what != "zero" or not owner.startswith("joint"):  # a second encoder has a zero, too
            continue
        known = e.sigma is not None and bool(np.all(np.isfinite(covariance)))
        alone = conditional_sigma(covariance, index[e.name], with_prior) if known else None
        found.append(JointZero(int(owner.removeprefix("joint")), e.value, e.sigma, alone, e.why))
    return tuple(found)


def conditional_sigma(covariance: Floats, one: int, others: NDArray[np.intp]) -> float:
    """Sigma of one parameter if the others were known exactly: the conditional variance of a normal law.

    Source: Eaton, Multivariate Statistics, 1983, prop. 3.13.
    """
    if len(others) == 0:
        return float(np.sqrt(covariance[one, one]))
    scale = np.sqrt(np.diag(covariance)[others])
    correlation = covariance[np.ix_(others, others)] / np.outer(scale, scale)
    pull = covariance[one, others] / scale
    return float(np.sqrt(max(covariance[one, one] - pull @ np.linalg.solve(correlation, pull), 0.0)))
