"""Powell's Dog-Leg: within a trust radius, from steepest descent to the Gauss-Newton step along two straight legs.

Sources: Powell, in Rabinowitz (ed.), Numerical Methods for Nonlinear Algebraic Equations, 1970; stopping rules,
radius and acceptance as in patent CN114523474B (Lu, Shi), step 6. Added to it: where J loses rank the Gauss-Newton
step is the shortest one, and bounds as in `rows`. All lengths are in columns scaled by plausible size.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.linear import gauss_newton_step
from calibrate.fit.solvers.result import Stop
from calibrate.fit.solvers.rows import (
    Ended,
    Rows,
    columns,
    gain_ratio,
)

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class DogLegRules:
    """The numbers of the patent's algorithm, in units of noise and of plausible size; a fit plan may set each."""

    e1: float = 1e-10  # of the largest element of the gradient
    e2: float = 1e-8  # of step and radius, relative to the parameters; below, gains are lost in rounding of the sum
    e3: float = 1e-13  # of the 2-norm of the residual: a ten-trillionth of the noise of one reading
    kmax: int = 100
    radius: float = 1.0  # initial; 1 = the deviation to be expected
    sigma: float = 0.25  # the radius is halved where the gain ratio of a step is below this


def dogleg(rows: Rows, theta: Floats, rules: DogLegRules) -> Ended:
    """Least squares from theta (param,) within the bounds."""
    residual = rows.residual(theta)
    if not np.all(np.isfinite(residual)):
        return Ended(theta, residual, None, Stop.NOT_FINITE, 0)
    radius = rules.radius
    local = _Local.at(rows, theta, residual)
    for k in range(rules.kmax):
        if local.newton is None:
            return Ended(theta, residual, None, Stop.NOT_FINITE, k)
        small = rules.e2 * (float(np.linalg.norm(rows.scaled(theta))) + rules.e2)
        stop = _stop_before(rules, local.gradient, residual, radius, small)
        if stop is not None:
            return Ended(theta, residual, local.slope, stop, k)
        step = np.zeros(len(rows.free))
        step[local.active] = dogleg_step(columns(local.slope, local.active), local.newton, local.gradient, radius)
        length = float(np.linalg.norm(step))
        if length <= small:
            return Ended(theta, residual, local.slope, Stop.STEP, k)
        trial = rows.moved(theta, step)
        new = rows.residual(trial)
        gain = gain_ratio(residual, new, local.slope @ rows.taken(theta, trial))
        if gain > 0.0:
            theta, residual = trial, new
            local = _Local.at(rows, theta, residual)
        radius = next_radius(radius, gain, length, rules.sigma)
    return Ended(theta, residual, local.slope, Stop.STEPS, rules.kmax)


@dataclass(frozen=True)
class _Local:
    """The linear model at one theta; rejected steps use it again."""

    slope: Floats  # (row, free)
    active: Bools  # (free,) not pressed against a bound
    gradient: Floats  # (active,)
    newton: Floats | None  # (active,) Gauss-Newton step; None where the slope is not finite

    @classmethod
    def at(cls, rows: Rows, theta: Floats, residual: Floats) -> "_Local":
        slope = rows.jacobian(theta)
        gradient = slope.T @ residual
        active = ~rows.pressed(theta, gradient)
        usable = bool(np.all(np.isfinite(slope)))
        newton = gauss_newton_step(columns(slope, active), residual) if usable else None
        return cls(slope, active, gradient[active], newton)


def dogleg_step(slope: Floats, newton: Floats, gradient: Floats, radius: float) -> Floats:
    """(free,) the step: Gauss-Newton where it fits, else descent to the radius, else the second leg up to it."""
    if np.linalg.norm(newton) <= radius:
        return newton
    descent = -gradient
    fall = float(np.linalg.norm(descent))
    reach = fall**2 / float(np.sum((slope @ gradient) ** 2))  # a: minimum of the linear model along the descent
    if reach * fall >= radius:
        return radius / fall * descent
    return reach * descent + second_leg(reach * descent, newton, radius) * (newton - reach * descent)


def second_leg(cauchy: Floats, newton: Floats, radius: float) -> float:
    """Share 0..1 of the second leg: |cauchy + beta (newton - cauchy)| = radius; |cauchy| <= radius <= |newton|.

    Root of the quadratic in the form that does not cancel: Madsen, Nielsen, Tingleff 2004, eq. (3.20).
    """
    way = newton - cauchy
    along, square = float(cauchy @ way), float(way @ way)
    room = radius**2 - float(cauchy @ cauchy)
    root = float(np.sqrt(max(along**2 + square * room, 0.0)))
    return (root - along) / square if along <= 0.0 else room / (along + root)


def next_radius(radius: float, gain: float, length: float, sigma: float = DogLegRules.sigma) -> float:
    """Radius after a step of this length with this gain ratio; a refused step always halves it, or it would recur."""
    if gain > 0.75:
        return max(radius, 3.0 * length)
    return radius / 2.0 if gain < sigma or gain <= 0.0 else radius


def _stop_before(rules: DogLegRules, gradient: Floats, residual: Floats, radius: float, small: float) -> Stop | None:
    """The rule that holds before a step is tried, None to go on."""
    if np.max(np.abs(gradient), initial=0.0) <= rules.e1:
        return Stop.GRADIENT
    if np.linalg.norm(residual) <= rules.e3:
        return Stop.RESIDUAL
    return Stop.RADIUS if radius <= small else None
