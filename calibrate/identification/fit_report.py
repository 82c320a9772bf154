"""From a settled fit to its result: estimates with their doubt, noise found, what was there before."""

from importlib.metadata import version

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student_t

from calibrate.blunders.finding import Blunder
from calibrate.fit import NEAR_START, Fit, Status, solve
from calibrate.identification.held_out import lengths, proof
from calibrate.identification.pull import pull_of_unseen
from calibrate.identification.result import Identification, InstrumentFound, Noise
from calibrate.identification.rounds import Fitted
from calibrate.identification.session import NEGLIGIBLE_RAD, about_of
from calibrate.parameters import hold, plausible_sizes, start_values
from calibrate.uncertainty.chi_square import RepeatNoise, against_repeats, against_stated
from calibrate.weighting import JOINT
from calibrate.zeros.identify import LEAST_DOF, estimate_of
from calibrate.zeros.result import Estimate

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HELD = "held so that a combination has an answer; see the combinations"
TOLD = 0.05  # of the plausible size: a member of an unseen combination that can move no further is a number


def result_of(
    fitted: Fitted, blunders: tuple[Blunder, ...], repeat: Ints | None, *, rng: Generator, held_out_share: float
) -> Identification:
    """Everything that travels with the values; `repeat` (row of the samples,) names groups of repeated poses."""
    fit, before = fitted.fit, fit_places_only(fitted)
    status = fit.status
    if status is Status.CONVERGED and fitted.seen.combinations:
        status = Status.RANK_DEFICIENT
    proven = held_out_share > 0.0 and status is not Status.NOT_FINITE
    rows = [m.sample_rows.ravel() for m in fitted.weighting.measured]
    return Identification(
        status,
        blunders,
        _estimates(fitted),
        fitted.seen,
        tuple(_found(fitted, i, before.theta) for i in range(len(rows))),
        _noise(fitted),
        against_stated(_as_stated(fitted)),
        _repeats(fitted, repeat),
        proof(fitted, before.parameters, before.theta, held_out_share, rng) if proven else (),
        fitted.problem.parameters,
        fit.theta,
        fit.covariance,
        about_of(fitted.weighting),
        len(np.unique(np.concatenate(rows))),
        fitted.steps,
        f"calibeam {version('calibeam')}",
    )


def fit_places_only(fitted: Fitted) -> Fit:
    """The arm as drawn, put where the data want it: what there was before the identification."""
    arm = {p.name for m in fitted.weighting.measured for p in m.problem.chain.model.parameters}
    parameters = hold(fitted.fit.parameters, arm)
    start = np.where([p.name in arm for p in parameters], start_values(parameters), fitted.fit.theta)
    return solve(fitted.problem.with_parameters(parameters), start=start)


def _as_stated(fitted: Fitted) -> Fit:
    """The fit under the noise as believed, for its chi-square."""
    problem = fitted.weighting.problem(fitted.fit.theta).with_parameters(fitted.fit.parameters)
    return solve(problem, start=fitted.fit.theta, damping=NEAR_START)


def _estimates(fitted: Fitted) -> tuple[Estimate, ...]:
    fit, seen = fitted.fit, fitted.seen
    usable = np.all(np.isfinite(fit.covariance))
    sigma = _widening(fitted) * np.sqrt(np.diag(fit.covariance)) if usable else np.full(len(fit.theta), np.nan)
    pulled = pull_of_unseen(fitted.problem.jacobian(fit.theta), fitted.problem.parameters)
    free = np.array([p.free for p in fit.parameters])
    told = free & (pulled < TOLD * plausible_sizes(fit.parameters))
    total = np.hypot(sigma, pulled)
    return tuple(
        estimate_of(p, float(fit.theta[i]), float(total[i]), fit, None if told[i] else seen.reason(p.name) or HELD)
        for i, p in enumerate(fitted.problem.parameters)
    )


def _widening(fitted: Fitted) -> Floats:
    """(param,) factor on sigma that keeps the odds of 3 sigma when the noise is known from few data."""
    parameters = fitted.fit.parameters
    dof = fitted.weighting.doubt(parameters, fitted.fit.theta, fitted.factors)
    out = np.ones(len(parameters))
    out[[p.free for p in parameters]] = student_t.ppf(norm.cdf(3.0), np.maximum(dof, LEAST_DOF)) / 3.0
    return out


def _noise(fitted: Fitted) -> tuple[Noise, ...]:
    """Every source that was asked for its size."""
    weighting, factors = fitted.weighting, fitted.factors
    believed = {
        source: float(np.median(sigma[sigma > 0.0]))
        for m in reversed(weighting.measured)
        for source, sigma in m.own_sigma.items()
    }
    if weighting.joint_rad > NEGLIGIBLE_RAD:
        believed[JOINT] = weighting.joint_rad
    return tuple(
        Noise(name, believed[name], believed[name] * float(f), believed[name] * float(s))
        for name, f, s in zip(weighting.sources, factors.factor, factors.factor_sigma, strict=True)
        if name in believed
    )


def _found(fitted: Fitted, index: int, before: Floats) -> InstrumentFound:
    measured, problem, theta = fitted.weighting.measured[index], fitted.problem, fitted.fit.theta
    return InstrumentFound(
        measured.name,
        measured.problem.rows,
        _rms(lengths(problem, index, before)),
        _rms(lengths(problem, index, theta)),
        measured.sample_rows,
        measured.problem.misfit(problem.of_block(index, theta)),
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _repeats(fitted: Fitted, repeat: Ints | None) -> RepeatNoise | None:
    if repeat is None:
        return None
    for i, measured in enumerate(fitted.weighting.measured):
        if measured.sample_rows.shape[1] > 1:
            continue
        block = fitted.problem.blocks[i]
        residual = block.residual(fitted.problem.of_block(i, fitted.fit.theta)).reshape(block.rows, -1)
        found = against_repeats(fitted.fit, residual, repeat[measured.sample_rows[:, 0]])
        if found is not None:
            return found
    return None
