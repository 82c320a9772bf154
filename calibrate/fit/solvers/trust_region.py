"""The two trust-region methods: Levenberg-Marquardt and Powell's Dog-Leg.

Levenberg-Marquardt, with the damping led by the gain ratio. Sources: Marquardt, J. SIAM 11(2), 1963 (damping in scaled
columns); Madsen, Nielsen, Tingleff, Methods for non-linear least squares problems, 2nd ed. 2004, alg. 3.16 (damping by
the gain ratio).

Where a combination that is hardly seen turns others that are seen well, straight steps leave a narrow, bent valley at
once, and damping makes them creep. What a step has done beyond its linear model is then taken back by a second one of
the same normal equations, for one evaluation more (second-order correction; as geodesic acceleration, Transtrum,
Sethna, Improvements to the Levenberg-Marquardt algorithm, 2012, arXiv:1201.5885, section 4).

Powell's Dog-Leg: within a trust radius, from steepest descent to the Gauss-Newton step along two straight legs.
Sources: Powell, in Rabinowitz (ed.), Numerical Methods for Nonlinear Algebraic Equations, 1970; stopping rules,
radius and acceptance as in patent CN114523474B (Lu, Shi), step 6. Added to it: where J loses rank the Gauss-Newton
step is the shortest one, and bounds as in `WeightedRows`. All lengths are in columns scaled by plausible size.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.least_squares import (
    Ended,
    Stop,
    WeightedRows,
    columns,
    damped_step,
    gain_ratio,
    gauss_newton_step,
    promised_gain,
)

Floats = NDArray[np.float64]
FAR_START = 1e-3  # damping, of the largest diagonal element: Madsen et al. for a start that may be far off
NEAR_START = 1e-12  # for a start known to be good: the first step is all but a Gauss-Newton step
QUICKER = 0.01  # smallest factor on the damping; the book's 1/3 creeps along weak directions of these problems
STRAIGHT = 0.75  # gain ratio; below it, a step is bent after the valley
ASTRAY = -3e3  # gain ratio; below it, a step is so far out that it says nothing about the way back
DAMPING_LIMIT = 1e12  # no step helps any more: the residual is at its rounding floor
ENOUGH = 1e-4  # times tolerance, of the sum of squares: where residuals are huge, the same figures are enough
UNMEASURABLE = 1e-12  # of a sum of squares: rows of metres at micrometres of noise are rounded at 1e-10 of a sigma
ROUNDING = 1e-15  # of the sum of squares: a gain below is not there to be had
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class LevenbergRules:
    """When to stop. `tolerance`: a full step promises less than this of chi2 (noise is 1, so 1e-8 is 1e-4 sigma)."""

    damping: float = FAR_START
    max_steps: int = 100
    tolerance: float = 1e-8


def least_gain(tolerance: float, residual: Floats) -> float:
    """Decrease of the sum of squares that is not worth a step: `tolerance`, but at least 1e-4 of it times the sum."""
    return max(tolerance, max(ENOUGH * tolerance, ROUNDING) * float(residual @ residual))


def levenberg(rows: WeightedRows, theta: Floats, rules: LevenbergRules) -> Ended:
    """Least squares from theta (param,) within the bounds."""
    residual = rows.residual(theta)
    if not np.all(np.isfinite(residual)):
        return Ended(theta, residual, None, Stop.NOT_FINITE, 0)
    slope, damping, growth = rows.jacobian(theta), rules.damping, 2.0
    least_promise = np.inf  # of the steps that were taken on the linear model's word alone
    for steps in range(rules.max_steps):
        if not np.all(np.isfinite(slope)):
            return Ended(theta, residual, None, Stop.NOT_FINITE, steps)
        gradient = slope.T @ residual
        active = ~rows.pressed(theta, gradient)
        moving = columns(slope, active)
        normal = moving.T @ moving
        promised = promised_gain(normal, gradient[active])
        if promised < least_gain(rules.tolerance, residual):
            return Ended(theta, residual, slope, Stop.GAIN, steps)
        if damping > DAMPING_LIMIT:
            return Ended(theta, residual, slope, Stop.DAMPING, steps)
        step = np.zeros(len(rows.free))
        step[active] = damped_step(normal, gradient[active], damping)
        trial = rows.moved(theta, step)
        new, change = rows.residual(trial), slope @ rows.taken(theta, trial)
        gain = gain_ratio(residual, new, change)
        if ASTRAY < gain < STRAIGHT and np.all(np.isfinite(new)):
            step[active] = damped_step(normal, moving.T @ (new - residual - change), damping)
            bent = rows.moved(trial, step)
            along = rows.residual(bent)
            if (better := gain_ratio(residual, along, change)) > gain:
                trial, new, gain = bent, along, better
        if _lost_in_rounding(promised, residual, new):
            if promised >= least_promise:  # such a step had left nothing to gain: the promise, too, is rounding by now
                return Ended(theta, residual, slope, Stop.ROUNDING, steps)
            least_promise = promised
            gain = 1.0  # the linear model is the better witness
        if gain > 0.0:
            theta, residual, slope = trial, new, rows.jacobian(trial)
            damping *= max(QUICKER, 1.0 - (2.0 * gain - 1.0) ** 3)
            growth = 2.0
        else:
            damping *= growth
            growth *= 2.0
    return Ended(theta, residual, slope, Stop.STEPS, rules.max_steps)


def _lost_in_rounding(promised: float, old: Floats, new: Floats) -> bool:
    """So near the minimum that neither the promise nor what came of it can be separated from rounding of the sum."""
    least = UNMEASURABLE * float(old @ old)
    return promised < least and abs(float((old - new) @ (old + new))) < least


@dataclass(frozen=True)
class DogLegRules:
    """The numbers of the patent's algorithm, in units of noise and of plausible size; a fit plan may set each."""

    e1: float = 1e-10  # of the largest element of the gradient
    e2: float = 1e-8  # of step and radius, relative to the parameters; below, gains are lost in rounding of the sum
    e3: float = 1e-13  # of the 2-norm of the residual: a ten-trillionth of the noise of one reading
    kmax: int = 100
    radius: float = 1.0  # initial; 1 = the deviation to be expected
    sigma: float = 0.25  # the radius is halved where the gain ratio of a step is below this


def dogleg(rows: WeightedRows, theta: Floats, rules: DogLegRules) -> Ended:
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
    def at(cls, rows: WeightedRows, theta: Floats, residual: Floats) -> "_Local":
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
