"""From a fit to what may be told of each parameter: a value with its doubt, or the reason why there is none."""

import numpy as np
from numpy.typing import NDArray

from calibrate.fit import Fit, Status
from calibrate.identifiability import Identifiability, analyse
from calibrate.identification.pull import TOLD, pull_of_unseen
from calibrate.parameters import Parameter, plausible_sizes, without_assumed
from calibrate.problem import Problem
from calibrate.zeros.result import HELD, ONLY_BELIEVED, UNSTATED, Estimate

Floats = NDArray[np.float64]


def seen_by_data(problem: Problem, fit: Fit, seen: Identifiability) -> tuple[Identifiability, Floats]:
    """What data and stated beliefs see, and (param,) what the rest may pull each parameter by: inf for its members.

    `seen` as of the fit, which a belief that nobody stated may hold: that one holds, but tells nothing.
    """
    asked = problem.chain.parameters
    if fit.status is Status.NOT_FINITE or not any(p.assumed for p in asked):
        return seen, np.array([0.0 if seen.reason(p.name) is None else np.inf for p in asked])
    bare, jacobian = without_assumed(asked), problem.jacobian(fit.theta)
    pulled = pull_of_unseen(jacobian, bare)
    return analyse(jacobian, bare), np.where(pulled < TOLD * plausible_sizes(asked), pulled, np.inf)


def estimates(
    problem: Problem, fit: Fit, seen: Identifiability, pulled: Floats, widening: Floats
) -> tuple[Estimate, ...]:
    """Of all parameters, in order; `seen` and `pulled` as of `seen_by_data`, `widening` (param,) a factor on sigma."""
    usable = np.all(np.isfinite(fit.covariance))
    sigma = widening * np.sqrt(np.diag(fit.covariance)) if usable else np.full(len(fit.theta), np.nan)
    out: list[Estimate] = []
    for i, p in enumerate(problem.chain.parameters):
        why = None if np.isfinite(pulled[i]) else untold(p, seen) or HELD
        total = float(sigma[i]) if why is not None else float(np.hypot(sigma[i], pulled[i]))
        out.append(estimate_of(p, float(fit.theta[i]), total, fit, why))
    return tuple(out)


def untold(p: Parameter, seen: Identifiability) -> str | None:
    """Why the rank forbids a number for a parameter, None if it does not."""
    why = seen.reason(p.name)
    return why if why is None or not p.assumed else f"{ONLY_BELIEVED}: {p.prior:.3g} {p.unit}, {UNSTATED}; {why}"


def estimate_of(p: Parameter, value: float, sigma: float, fit: Fit, unseen: str | None) -> Estimate:
    """The value with its sigma, or why there is none; `unseen`: what the identifiability says of the parameter."""
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
