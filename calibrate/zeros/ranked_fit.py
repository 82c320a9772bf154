"""Rank first, one of every unseen combination held, then least squares; by compiled loops where they serve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.arms import compiled as ready
from calibrate.fit import NEAR_START, Fit, solve
from calibrate.identifiability import Identifiability, analyse
from calibrate.kernels.dual_psd_rows import DualPsdRows
from calibrate.kernels.normal_fit import bounded, fit_normal
from calibrate.noisy_rows import IndependentRows, NoisyRows, common_axes
from calibrate.parameters import hold
from calibrate.problem import Problem
from calibrate.solvers.levenberg import LevenbergRules

Floats = NDArray[np.float64]

NEAR = LevenbergRules(NEAR_START)  # the rank is full and the start good
FAR = LevenbergRules()
COARSE = LevenbergRules(tolerance=1e-2)  # of chi2, a tenth of a sigma: what makes a start need not stand better


@dataclass(frozen=True)
class Ranked:
    """What the data see at the start, and the fit with the rest held."""

    seen: Identifiability
    fit: Fit


def ranked_fit(problem: Problem, theta: Floats, rules: LevenbergRules) -> Ranked:
    """From theta (param,), where unseen parameters stay."""
    rows = _compiled(problem)
    triangle = None if rows is None else rows.triangle(theta)
    jacobian = problem.jacobian(theta) if triangle is None else triangle[:, :-1]
    seen = analyse(jacobian, problem.parameters)
    held = problem.with_parameters(hold(problem.parameters, (c.representative for c in seen.combinations)))
    kept = None if triangle is None else DualPsdRows.of(held)
    if triangle is None or kept is None:
        return Ranked(seen, _solved(held, theta, rules))
    return Ranked(seen, fit_normal(kept, theta, kept.normal_of(theta, triangle), rules))


def fitted(problem: Problem, theta: Floats, rules: LevenbergRules) -> Fit:
    """From theta (param,); all that is free is determined."""
    rows = _compiled(problem)
    return _solved(problem, theta, rules) if rows is None else fit_normal(rows, theta, rows.normal(theta), rules)


def by_joint(problem: Problem, theta: Floats) -> Floats:
    """(pose, 4, joint) derivative of the spots by the joint angles."""
    rows = _compiled(problem)
    return problem.chain.by_joint(theta, problem.q_rad) if rows is None else rows.by_joint(theta)


def noisy_rows(problem: Problem, theta: Floats, parts: Floats) -> NoisyRows | IndependentRows:
    """Misfit and derivative by the free parameters at theta (param,); covariance `parts` (2, pose, 4, 4)."""
    rows = _compiled(problem)
    if rows is None:
        free = np.flatnonzero([p.free for p in problem.parameters])
        jacobian = problem.chain.jacobian(theta, problem.q_rad)[:, :, free]
        return NoisyRows(problem.misfit(theta), jacobian, parts, (0, 1))
    turn, share = common_axes(parts)
    turned = rows.weighted(turn).rows(theta)
    by_coordinate = share.reshape(2, -1, 4).transpose(0, 2, 1).reshape(2, -1)  # rows run over the poses first
    return IndependentRows(turned[:, -1], turned[:, :-1], by_coordinate, (0, 1))


def _solved(problem: Problem, theta: Floats, rules: LevenbergRules) -> Fit:
    return solve(problem, start=theta, damping=rules.damping, max_steps=rules.max_steps, tolerance=rules.tolerance)


def _compiled(problem: Problem) -> DualPsdRows | None:
    if not ready.worth(problem.rows) or bounded(problem.parameters):
        return None
    return DualPsdRows.of(problem)
