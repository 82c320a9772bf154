"""Full dual-PSD identification of joint zeros.

Joint zeros, placements and laser mount are free without any opinion; links, and detectors where the rig doubts them,
are free under the tolerance of the drawing; rank comes first, and what cannot be determined is held and named. Weights
are the noise of joints and detectors, re-estimated from the residuals. docs/decisions/0003 says why it is done so.
"""

from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from calibrate import noise as noise_model
from calibrate import variance
from calibrate.chain import Chain
from calibrate.errors import DataError, naming_undetermined
from calibrate.fit import Fit, Status
from calibrate.identifiability import Identifiability
from calibrate.noise import NoiseModel, VarianceFactors
from calibrate.observations import Observations
from calibrate.parameters import Parameter, hold, priors, start_values
from calibrate.problem import Problem, whitener_of
from calibrate.uncertainty.redundancy import spare_readings
from calibrate.zeros.estimates import estimates, seen_by_data
from calibrate.zeros.held_out import held_out_error
from calibrate.zeros.ranked_fit import COARSE, FAR, NEAR, by_joint, fitted, noisy_rows, ranked_fit
from calibrate.zeros.repeats import repeat_scatter
from calibrate.zeros.result import Estimate, HeldOut, JointZero, NoiseFound, ZeroResult

Floats = NDArray[np.float64]

ROUNDS = 4  # of weights and fit in turn; the second changes sigmas by percents, the third by less than 1e-3
SETTLED = 0.02  # of a log variance between rounds: 1 % of a sigma
LEAST_DOF = 3.0  # a Satterthwaite number below this is itself a guess


@dataclass(frozen=True)
class BelievedNoise:
    """One sigma as the rig file believes it; a start value only."""

    joint_rad: float
    psd_m: float  # of a spot, where the observations state none

    def model(self, data: Observations) -> NoiseModel:
        stated = np.full((len(data), 4), self.psd_m) if data.sigma_m is None else data.sigma_m
        return NoiseModel(self.joint_rad, stated)


@dataclass(frozen=True)
class Weighted:
    """A fit with the weights it was made under; what the held-out proof and a running session need of it."""

    problem: Problem
    fit: Fit
    factors: VarianceFactors
    parts: Floats  # (2, pose, 4, 4) believed covariance by joints and detectors
    seen: Identifiability  # at the estimate, before anything was held
    steps: int  # of all rounds
    settled: bool  # another round would change nothing


def identify(
    chain: Chain,
    data: Observations,
    believed: BelievedNoise,
    *,
    rng: Generator,
    start: Floats | None = None,
    held_out_share: float = 0.2,
) -> ZeroResult:
    """Everything about the zeros that these data tell.

    `start` (param,): values of an earlier fit of the same chain, which saves steps. `held_out_share` of the poses,
    drawn by `rng`, are predicted from the others (0: no held-out proof). DataError for an empty set.
    """
    weighted = fit_weighted(chain, data, believed, start=start)
    before = _fit_places_only(weighted)
    proof = None
    if held_out_share > 0.0 and weighted.fit.status is not Status.NOT_FINITE:
        proof = held_out_error(weighted.problem, before.parameters, weighted.fit.theta, held_out_share, rng)
    return _result(weighted, before, proof, data, believed)


def fit_weighted(chain: Chain, data: Observations, believed: BelievedNoise, *, start: Floats | None = None) -> Weighted:
    """Fit and noise in turn until both stand; this alone is what a running session repeats."""
    if len(data) == 0:
        raise DataError("identification of zeros: no poses at all; record settled samples with both spots lit")
    model = believed.model(data)
    problem = Problem(chain, chain.parameters, data.q_rad, data.spots_m, np.zeros((len(data), 4, 4)))
    theta, steps = _coarse(problem, model) if start is None else (start, 0)
    weighted = _round(problem, model, theta, noise_model.BELIEVED)
    steps += weighted.fit.steps
    for _ in range(ROUNDS - 1):
        if weighted.settled:
            break
        weighted = _round(weighted.problem, model, weighted.fit.theta, weighted.factors)
        steps += weighted.fit.steps
    return replace(weighted, steps=steps)


def _round(problem: Problem, model: NoiseModel, theta: Floats, factors: VarianceFactors) -> Weighted:
    """Weights, rank, fit, and then the noise that its residuals show."""
    parts = model.parts(by_joint(problem, theta))
    problem = problem.with_parameters(problem.chain.parameters).with_covariance(noise_model.total(parts, factors))
    ranked = ranked_fit(problem, theta, NEAR)
    fit, seen = ranked.fit, ranked.seen
    problem = problem.with_parameters(fit.parameters)
    if fit.status is Status.NOT_FINITE:
        return Weighted(problem, fit, factors, parts, seen, fit.steps, True)
    renewed = _noise(problem, fit.theta, parts, factors)
    change = float(np.max(np.abs(renewed.log_variance - factors.log_variance)))
    return Weighted(problem, fit, renewed, parts, seen, fit.steps, change < SETTLED)


def _coarse(problem: Problem, model: NoiseModel) -> tuple[Floats, int]:
    """Places, mount and zeros with the links as drawn: the large errors, without the small ones to hide in."""
    nominal = start_values(problem.parameters)
    parts = model.parts(by_joint(problem, nominal))
    drawn = hold(problem.parameters, (p.name for p in problem.parameters if p.free and np.isfinite(p.prior)))
    fit = ranked_fit(problem.with_parameters(drawn).with_covariance(parts.sum(axis=0)), nominal, COARSE).fit
    return (nominal if fit.status is Status.NOT_FINITE else fit.theta), fit.steps


def _fit_places_only(weighted: Weighted) -> Fit:
    """The nominal arm, put where the data want it: what there was before the identification."""
    problem = weighted.problem
    arm = [p.name for p in problem.chain.model.parameters]
    nominal = start_values(problem.parameters)
    nominal[len(arm) :] = weighted.fit.theta[len(arm) :]
    return fitted(problem.with_parameters(hold(problem.parameters, arm)), nominal, FAR)


def _noise(problem: Problem, theta: Floats, parts: Floats, known: VarianceFactors) -> VarianceFactors:
    """Sizes of both sources; the search starts from those `known`."""
    free, information = _free(problem.parameters)
    deviation = (theta - start_values(problem.parameters))[free]
    rows = noisy_rows(problem, theta, parts)
    with naming_undetermined([p.name for p in problem.parameters if p.free], problem.q_rad):
        return variance.estimate((rows,), 2, information, information * deviation, known)


def _free(parameters: tuple[Parameter, ...]) -> tuple[NDArray[np.intp], Floats]:
    """Free columns and the information of their priors (0: none)."""
    free = np.flatnonzero([p.free for p in parameters])
    return free, 1.0 / priors(parameters)[free] ** 2


def _widening(weighted: Weighted) -> Floats:
    """(param,) factor on sigma that keeps the odds of 3 sigma when the noise is known from few data."""
    problem, theta = weighted.problem, weighted.fit.theta
    free, information = _free(problem.parameters)
    with naming_undetermined([p.name for p in problem.parameters if p.free], problem.q_rad):
        dof = variance.doubt((noisy_rows(problem, theta, weighted.parts),), information, weighted.factors)
    out = np.ones(len(theta))
    out[free] = stdtrit(np.maximum(dof, LEAST_DOF), ndtr(3.0)) / 3.0
    return out


def _zeros(weighted: Weighted, told: tuple[Estimate, ...]) -> tuple[JointZero, ...]:
    fit = weighted.fit
    index = {p.name: i for i, p in enumerate(fit.parameters)}
    links = np.flatnonzero([p.free and np.isfinite(p.prior) for p in fit.parameters])
    found: list[JointZero] = []
    for e in told:
        owner, _, what = e.name.partition(".")
        if what != "zero":
            continue
        alone = None if e.sigma is None else _given_links(fit.covariance, index[e.name], links)
        found.append(JointZero(int(owner.removeprefix("joint")), e.value, e.sigma, alone, e.why))
    return tuple(found)


def _given_links(covariance: Floats, zero: int, links: NDArray[np.intp]) -> float:
    """Sigma of a zero if the drawing were known exactly: conditional variance of a normal law."""
    if len(links) == 0:
        return float(np.sqrt(covariance[zero, zero]))
    scale = np.sqrt(np.diag(covariance)[links])
    correlation = covariance[np.ix_(links, links)] / np.outer(scale, scale)
    pull = covariance[zero, links] / scale
    return float(np.sqrt(max(covariance[zero, zero] - pull @ np.linalg.solve(correlation, pull), 0.0)))


def _noise_found(weighted: Weighted, believed: BelievedNoise) -> NoiseFound:
    factors, parts, problem = weighted.factors, weighted.parts, weighted.problem
    psd_believed = float(np.median(np.sqrt(parts[1][:, range(4), range(4)])))
    as_believed = whitener_of(parts.sum(axis=0))
    residual = np.einsum("nij,nj->ni", as_believed, problem.misfit(weighted.fit.theta))
    fit = weighted.fit
    prior_chi2 = fit.chi2 - float(np.sum(problem.residual(fit.theta) ** 2))
    dof = max(fit.dof, 1)
    return NoiseFound(
        believed.joint_rad,
        believed.joint_rad * float(factors.factor[0]),
        believed.joint_rad * float(factors.factor_sigma[0]),
        psd_believed,
        psd_believed * float(factors.factor[1]),
        psd_believed * float(factors.factor_sigma[1]),
        (float(np.sum(residual**2)) + prior_chi2) / dof,
        fit.chi2_per_dof,
        factors.converged,
        *factors.at_zero,
    )


def _result(
    weighted: Weighted, before: Fit, proof: HeldOut | None, data: Observations, believed: BelievedNoise
) -> ZeroResult:
    problem, fit = weighted.problem, weighted.fit
    seen, pulled = seen_by_data(problem, fit, weighted.seen)
    told = estimates(problem, fit, seen, pulled, _widening(weighted))
    status = fit.status
    if status is Status.CONVERGED and seen.combinations:
        status = Status.RANK_DEFICIENT
    misfit_before, misfit_after = problem.misfit(before.theta), problem.misfit(fit.theta)
    return ZeroResult(
        status,
        _zeros(weighted, told),
        told,
        seen,
        _noise_found(weighted, believed),
        repeat_scatter(problem.whitener, misfit_after, data.repeat, fit.chi2, fit.dof),
        proof,
        float(np.sqrt(np.mean(misfit_before**2))),
        float(np.sqrt(np.mean(misfit_after**2))),
        misfit_before,
        misfit_after,
        problem.chain.parameters,
        fit.theta,
        fit.covariance,
        len(data),
        spare_readings(problem, fit.theta, fit.covariance),
        weighted.steps,
        fit.stop,
        f"calibeam {version('calibeam')}",
    )
