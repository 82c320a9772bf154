"""Fit and weights in turn: rank, what is redundant, least squares, and the noise that the residuals then show.

There are two starts: first what no prior speaks of (zeros, places, targets), with nominal links, then everything.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.noise.variance import VarianceFactors
from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.fit.rank.observability import Redundant, reduced
from calibrate.fit.solvers import (
    FAR_START,
    NEAR_START,
    Fit,
    Status,
    solve,
)
from calibrate.fit.solvers.robust import Loss
from calibrate.fit.solvers.solve import LEAST_SQUARES, Estimator
from calibrate.fit.weighting import Weighting
from calibrate.model.parameters import hold, plausible_sizes
from calibrate.model.problem import Block, Problem

Floats = NDArray[np.float64]

ROUNDS = 6  # of weights and fit in turn
COARSE = 1e-2  # of chi2, a tenth of a sigma: a start need not be better
SETTLED = 0.02  # of every log variance, and of shares, between two rounds: 1 % of a sigma
BLUNT_ROUNDS = 8  # of least distances, to come away from a start that bad rows have pulled
WARY_ROUNDS = 12  # of letting go of far rows
NEAR = 0.1  # of the usual distance: closer rows all weigh the same
STANDING = 1e-3  # of a plausible size: a step below changes no suspicion
LEAST_SCALE = 1e-6  # of the assumed noise: perfect data have a scale, too


@dataclass(frozen=True)
class SettledFit:
    """A fit under its weights; `seen` at its end, before anything redundant was held."""

    weighting: Weighting
    problem: JointProblem
    fit: Fit
    seen: Identifiability
    factors: VarianceFactors  # noise found over assumed, of weighting.sources
    steps: int  # of all rounds
    by: Estimator = LEAST_SQUARES


def settled_fit(
    weighting: Weighting, start: Floats, redundant: Redundant = Redundant.REMOVED, by: Estimator = LEAST_SQUARES
) -> SettledFit:
    """Rounds from `start` (param,) until weights and rank stand."""
    fitted = _round(weighting, weighting.assumed_factors, start, FAR_START, redundant, by)
    steps = fitted.fit.steps
    for _ in range(ROUNDS - 1):
        if fitted.fit.status is Status.NOT_FINITE:
            break
        rank, theta = fitted.seen.rank, fitted.fit.theta
        shares, weighting = weighting.shares, weighting.sharing(theta, fitted.factors)
        factors = weighting.noise(fitted.fit.parameters, theta, fitted.factors)
        change = float(np.max(np.abs(factors.log_variance - fitted.factors.log_variance)))
        if weighting.shares is not None:
            change = max(change, float(np.max(np.abs(weighting.shares - (0.0 if shares is None else shares)))))
        fitted = _round(weighting, factors, theta, NEAR_START, redundant, by)
        steps += fitted.fit.steps
        if change < SETTLED and fitted.seen.rank == rank:
            break
    return replace(fitted, steps=steps)


def first_fit(weighting: Weighting, start: Floats) -> Floats:
    """(param,) of one round from `start` (param,), the noise as assumed: enough to compare misfits by factors."""
    return _round(weighting, weighting.assumed_factors, start, FAR_START, Redundant.REMOVED).fit.theta


def coarse_start(weighting: Weighting, start: Floats) -> Floats:
    """(param,) large errors without small ones to hide in: what a prior speaks of stays at `start` (param,).

    A joint zero of degrees must not be explained by links that are off their drawing. `start` as it is where nothing
    has a prior, or where the fit is not finite.
    """
    problem = weighting.problem(start)
    with_prior = {p.name for p in problem.parameters if p.free and np.isfinite(p.prior)}
    rest = problem.with_parameters(hold(problem.parameters, with_prior))
    if not with_prior or not any(p.free for p in rest.parameters):
        return start
    seen = analyse(rest.fulfilled(start).jacobian(start), rest.parameters)
    fit = solve(rest.with_parameters(reduced(rest.parameters, seen)), start=start, tolerance=COARSE)
    return start if fit.status is Status.NOT_FINITE else fit.theta


def wary_fit(weighting: Weighting, start: Floats) -> Floats:
    """(param,) values that bad rows cannot pull: the least sum of distances, then far rows are let go (Cauchy)."""
    first = _round(weighting, weighting.assumed_factors, start, FAR_START, Redundant.REMOVED)
    problem, theta = first.problem, first.fit.theta
    for turn in range(BLUNT_ROUNDS + WARY_ROUNDS):
        letting_go = turn >= BLUNT_ROUNDS
        each = zip(problem.blocks, distances(problem, theta), strict=True)
        blocks = [_wary(block, distance, letting_go=letting_go) for block, distance in each]
        old, theta = theta, _fitted(problem.with_blocks(tuple(blocks)), theta, NEAR_START, Redundant.REMOVED)[0].theta
        if letting_go and np.max(np.abs(theta - old) / plausible_sizes(problem.parameters)) < STANDING:
            break
    return theta


def distances(problem: JointProblem, theta: Floats) -> list[Floats]:
    """Of each block (row,): length of the whitened misfit."""
    ends = np.cumsum([block.rows for block in problem.blocks])
    return np.split(np.sqrt(problem.by_row(theta)), ends[:-1])


def _round(
    weighting: Weighting,
    factors: VarianceFactors,
    start: Floats,
    damping: float,
    redundant: Redundant,
    by: Estimator = LEAST_SQUARES,
) -> SettledFit:
    problem = weighting.problem(start, factors)
    fit, seen = _solved(problem, start, damping, redundant, by)
    return SettledFit(weighting, problem, fit, seen, factors, fit.steps, by)


def _solved(
    problem: JointProblem, start: Floats, damping: float, redundant: Redundant, by: Estimator = LEAST_SQUARES
) -> tuple[Fit, Identifiability]:
    """Least squares of what can be determined at the start, and the rank at the end."""
    fit, seen = _fitted(problem, start, damping, redundant, by)
    if fit.status is not Status.NOT_FINITE:
        seen = analyse(problem.fulfilled(fit.theta).jacobian(fit.theta), problem.parameters)
    return fit, seen


def _fitted(
    problem: JointProblem, start: Floats, damping: float, redundant: Redundant, by: Estimator = LEAST_SQUARES
) -> tuple[Fit, Identifiability]:
    """Least squares of what can be determined at the start, and the rank there."""
    seen = analyse(problem.fulfilled(start).jacobian(start), problem.parameters)
    return by.fit(problem.with_parameters(reduced(problem.parameters, seen, redundant)), start, damping), seen


def _wary(block: Block, distance: Floats, *, letting_go: bool) -> Block:
    """Weights by distance (row,) over the usual one; a stated length keeps its own."""
    if not isinstance(block, Problem):
        return block
    per_coordinate = distance / np.sqrt(block.observed.shape[1])
    scale = max(float(np.median(per_coordinate)), LEAST_SCALE)
    z = per_coordinate / scale
    root = np.sqrt(Loss.CAUCHY.weight(z) if letting_go else 1.0 / np.maximum(z, NEAR)) / scale
    return replace(block, whitener=block.whitener * root[:, None, None])
