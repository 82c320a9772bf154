"""From a settled fit to its result: estimates with their uncertainty, noise found, what was there before.

How far an unseen combination can pull on each parameter: which of its members have a number all the same.
What the data do not see is known no better than to its plausible size. A parameter that has a share of 1e-4 in it moves
by 1e-4 of its own plausible size when the combination moves by all of that: it is determined, and what little it is
pulled goes into its sigma. Where a combination bends (fit/rank/observability.py) the largest pull on its way counts.
"""

from dataclasses import replace
from importlib.metadata import version

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.fit.accuracy import (
    RepeatNoise,
    against_repeats,
    against_stated,
    minus_2_log_likelihood,
)
from calibrate.fit.identify.estimates import (
    HELD,
    ONLY_ASSUMED,
    Estimate,
    assumed_size,
    estimate_of,
    undetermined_why,
)
from calibrate.fit.identify.evidence import EvidenceOptions, evidence_of, lengths, rows_used
from calibrate.fit.identify.result import (
    FitEnd,
    Identification,
    InstrumentFound,
    Noise,
)
from calibrate.fit.identify.rounds import SettledFit
from calibrate.fit.identify.session import NEGLIGIBLE_RAD, about_of
from calibrate.fit.noise.variance import VarianceFactors
from calibrate.fit.rank.identifiability import STRUCTURAL, WEAK, Identifiability
from calibrate.fit.rank.observability import analyse_along, points_along
from calibrate.fit.solvers import FAR_START, Fit, Status
from calibrate.fit.solvers.least_squares import triangle_of
from calibrate.fit.weighting import JOINT, Weighting
from calibrate.model.checks.gross_error import GrossError
from calibrate.model.parameters import (
    Parameter,
    hold,
    plausible_sizes,
    priors,
    start_values,
    without_assumed,
)
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_DOF = 3.0  # a Satterthwaite number below this is itself a guess
ONLY_PRIOR = 2.0 / np.sqrt(5.0)  # of a prior sigma: the data alone know it to twice that, see identifiability.WEAK

PULLED_SHARE = 0.05  # of the plausible size: a member of an unseen combination that can move no further is a number
SEEN = 2.0  # sigma: joint repeatability that second encoders have taken out, as against none
FAR = 3.0  # plausible sizes that the truth of an unseen combination may lie from where it was held


def result_of(
    fitted: SettledFit,
    gross_errors: tuple[GrossError, ...],
    rig: Rig,
    samples: Samples,
    *,
    asked: EvidenceOptions,
    rng: Generator,
) -> Identification:
    """Everything that travels with the values; `samples` are the whole file, of which the fit took some rows."""
    fit, before = fitted.fit, fit_places_only(fitted)
    seen = fitted.seen
    if fit.status is not Status.NOT_FINITE:
        seen = analyse_along(fitted.problem, fit.theta, without_assumed(fitted.problem.parameters))
    status = fit.status
    if status is Status.CONVERGED and seen.combinations:
        status = Status.RANK_DEFICIENT
    noise, stated = sizes_of_noise(fitted.weighting, fitted.factors), _as_stated(fitted)
    return Identification(
        status,
        gross_errors,
        _estimates(fitted, seen),
        seen,
        tuple(_found(fitted, i, before.theta) for i in range(len(fitted.weighting.measured))),
        noise,
        fitted.factors.converged,
        against_stated(stated.chi2, stated.dof),
        _repeats(fitted, samples.integers("repeat", -1) if "repeat" in samples else None),
        evidence_of(fitted, seen, before, noise, rig, samples, asked, rng),
        fitted.problem.parameters,
        fit.theta,
        fit.covariance,
        about_of(fitted.weighting),
        len(rows_used(fitted)),
        FitEnd(
            fitted.by.method,
            fitted.by.loss.kind,
            fitted.steps,
            fitted.fit.stop,
            minus_2_log_likelihood(fitted.problem, fitted.fit.theta),
        ),
        f"calibeam {version('calibeam')}",
        sum(block.rows for block in fitted.weighting.known),
    )


def fit_places_only(fitted: SettledFit) -> Fit:
    """The nominal arm, put where the data want it: what there was before the identification."""
    arm = {p.name for m in fitted.weighting.measured for p in m.problem.chain.model.parameters}
    parameters = hold(fitted.fit.parameters, arm)
    start = np.where([p.name in arm for p in parameters], start_values(parameters), fitted.fit.theta)
    return fitted.by.with_usual_rules.fit(fitted.problem.with_parameters(parameters), start, FAR_START)


def _as_stated(fitted: SettledFit) -> Fit:
    """The fit under the noise as assumed, for its chi-square."""
    alone = replace(fitted.weighting, shares=None)  # what encoders know of a row is part of the noise that is stated
    problem = alone.problem(fitted.fit.theta).with_parameters(fitted.fit.parameters)
    return fitted.by.with_usual_rules.fit(problem, fitted.fit.theta)


def _estimates(fitted: SettledFit, seen: Identifiability) -> tuple[Estimate, ...]:
    fit = fitted.fit
    usable = np.all(np.isfinite(fit.covariance))
    sigma = _widening(fitted) * np.sqrt(np.diag(fit.covariance)) if usable else np.full(len(fit.theta), np.nan)
    pulled = np.zeros(len(fit.theta))
    if fit.status is not Status.NOT_FINITE:
        pulled = pull_along(fitted.problem, fit.theta, without_assumed(fitted.problem.parameters), seen)
    free = np.array([p.free for p in fit.parameters])
    narrow = free & (pulled < PULLED_SHARE * plausible_sizes(fit.parameters))
    total = np.hypot(sigma, pulled)
    return tuple(
        estimate_of(p, float(fit.theta[i]), float(total[i]), fit, _why_not(p, fit, i, seen, narrow=bool(narrow[i])))
        for i, p in enumerate(fitted.problem.parameters)
    )


def _why_not(p: Parameter, fit: Fit, i: int, seen: Identifiability, *, narrow: bool) -> str | None:
    if not narrow:
        return undetermined_why(p, seen) or HELD
    if np.isfinite(p.prior) and np.sqrt(fit.covariance[i, i]) > ONLY_PRIOR * p.prior:
        return f"{ONLY_ASSUMED}: {assumed_size(p)}; these data do not determine it better"
    return None


def _widening(fitted: SettledFit) -> Floats:
    """(param,) factor on sigma that keeps the odds of 3 sigma when the noise is known from few data."""
    parameters = fitted.fit.parameters
    dof = fitted.weighting.dof(parameters, fitted.fit.theta, fitted.factors)
    out = np.ones(len(parameters))
    out[[p.free for p in parameters]] = stdtrit(np.maximum(dof, LEAST_DOF), ndtr(3.0)) / 3.0
    return out


def sizes_of_noise(weighting: Weighting, factors: VarianceFactors) -> tuple[Noise, ...]:
    """Every source of noise that was asked for its size: one sigma in m or rad, as assumed and as `factors` have it."""
    assumed = {
        source: float(np.median(sigma[sigma > 0.0]))
        for m in reversed(weighting.measured)
        for source, sigma in m.own_sigma.items()
    }
    if weighting.joint_rad > NEGLIGIBLE_RAD:
        assumed[JOINT] = weighting.joint_rad
    found = {
        name: Noise(name, assumed[name], assumed[name] * float(f), assumed[name] * float(s), at_zero)
        for name, f, s, at_zero in zip(
            weighting.sources, factors.factor, factors.factor_sigma, factors.at_zero, strict=True
        )
        if name in assumed
    }
    if JOINT in found:
        found[JOINT] = _with_shared(found[JOINT], *weighting.shared_rad(factors))
    return tuple(found.values())


def _with_shared(joint: Noise, shared_rad: float, sigma_rad: float) -> Noise:
    """Joint repeatability as found beyond second encoders, and what these have seen of it."""
    if shared_rad == 0.0:
        return joint
    size = float(np.hypot(joint.found, shared_rad))
    sigma = float(np.hypot(joint.found * joint.sigma, shared_rad * sigma_rad)) / size
    return replace(joint, found=size, sigma=sigma, at_zero=joint.at_zero and shared_rad < SEEN * sigma_rad)


def _found(fitted: SettledFit, index: int, before: Floats) -> InstrumentFound:
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


def _repeats(fitted: SettledFit, repeat: Ints | None) -> RepeatNoise | None:
    if repeat is None:
        return None
    for i, measured in enumerate(fitted.weighting.measured):
        if measured.sample_rows.shape[1] > 1:
            continue
        block = fitted.problem.blocks[i]
        residual = fitted.problem.residual_of(i, fitted.fit.theta).reshape(block.rows, -1)
        found = against_repeats(fitted.fit, residual, repeat[measured.sample_rows[:, 0]])
        if found is not None:
            return found
    return None


def pull_of_unseen(jacobian: Floats, parameters: tuple[Parameter, ...]) -> Floats:
    """(param,) in its unit, for the whitened Jacobian (row, param): one sigma of what unseen combinations add.

    Rank and scaling are those of identifiability.analyse.
    """
    free = np.flatnonzero([p.free for p in parameters])
    scale, prior = plausible_sizes(parameters)[free], priors(parameters)[free]
    rows = np.concatenate([jacobian[:, free] * scale, np.diag(scale / prior)])
    _, s, Vt = np.linalg.svd(triangle_of(rows))
    unseen = Vt[s <= max(WEAK, STRUCTURAL * s[0])]
    out = np.zeros(len(parameters))
    out[free] = FAR * scale * np.linalg.norm(unseen, axis=0)
    return out


def pull_along(
    problem: LeastSquares, theta: Floats, parameters: tuple[Parameter, ...], seen: Identifiability
) -> Floats:
    """(param,) the same, the largest at `theta` and on the way along what is `seen` as unseen there."""
    points = (theta, *points_along(seen, theta, parameters))
    return np.max([pull_of_unseen(problem.jacobian(point), parameters) for point in points], axis=0)
