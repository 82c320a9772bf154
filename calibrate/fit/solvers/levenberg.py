"""Damped least squares (Levenberg-Marquardt) with the damping led by the gain ratio.

Sources: Marquardt, J. SIAM 11(2), 1963 (damping in scaled columns); Madsen, Nielsen, Tingleff, Methods for non-linear
least squares problems, 2nd ed. 2004, alg. 3.16 (damping by the gain ratio).

Where a combination that is hardly seen turns others that are seen well, straight steps leave a narrow, bent valley at
once, and damping makes them creep. What a step has done beyond its linear model is then taken back by a second one of
the same normal equations, for one evaluation more (second-order correction; as geodesic acceleration, Transtrum,
Sethna, Improvements to the Levenberg-Marquardt algorithm, 2012, arXiv:1201.5885, section 4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.linear import damped_step, promised_gain
from calibrate.fit.solvers.result import Stop
from calibrate.fit.solvers.rows import (
    Ended,
    Rows,
    columns,
    gain_ratio,
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


@dataclass(frozen=True)
class LevenbergRules:
    """When to stop. `tolerance`: a full step promises less than this of chi2 (noise is 1, so 1e-8 is 1e-4 sigma)."""

    damping: float = FAR_START
    max_steps: int = 100
    tolerance: float = 1e-8


def least_gain(tolerance: float, residual: Floats) -> float:
    """Decrease of the sum of squares that is not worth a step: `tolerance`, but at least 1e-4 of it times the sum."""
    return max(tolerance, max(ENOUGH * tolerance, ROUNDING) * float(residual @ residual))


def levenberg(rows: Rows, theta: Floats, rules: LevenbergRules) -> Ended:
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
