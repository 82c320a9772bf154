"""Instruments of one session with what is assumed of their noise, and the joint problem under given noise.

Noise of a row is joint repeatability mapped through the arm, G G' joint^2 with G the derivative by the readings, plus
the instrument's own. Which pose a row belongs to is known to the instrument alone, so this holds for pairs of poses
too. Neighbouring distances share a pose, which their weights respect. What second encoders see of the joints at a pose
is taken out of the rows of the others there (fit/noise/scatter.py). Otherwise rows of two instruments at one
pose (a position and a wire) are taken as independent, and sizes of noise are found as if all rows were.
"""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import naming_undetermined
from calibrate.fit.joint_problem import JointProblem, Witnessed
from calibrate.fit.noise import variance
from calibrate.fit.noise.scatter import (
    Lever,
    SharedScatter,
    levers_of,
    shares_found,
    witness_of,
)
from calibrate.fit.noise.variance import (
    FIXED,
    NoisyRows,
    VarianceFactors,
    as_assumed,
    covariance_of,
)
from calibrate.model.parameters import Parameter, priors, start_values
from calibrate.model.problem import Block, Measured, Problem

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

ENOUGH = 20_000  # rows of an instrument from which sizes of noise are found: 0.5 % of a sigma, whatever more there is
JOINT = "joint"  # the source of noise that all instruments share


@dataclass(frozen=True)
class Weighting:
    """What is measured, and lengths that are known to a stated sigma (blocks of one residual a row)."""

    measured: tuple[Measured, ...]
    joint_rad: float  # assumed repeatability of one joint reading
    known: tuple[Block, ...] = ()
    chosen: tuple[Parameter, ...] | None = None  # `parameters` held or assumed otherwise, in the same order
    shares: Floats | None = None  # (channel,) of what second encoders read that is the links' own; None: not yet known
    share_sigmas: Floats | None = None  # (channel,)

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """Names of the sources of noise, in the order of VarianceFactors."""
        own = (source for instrument in self.measured for source in instrument.own_sigma)
        return tuple(dict.fromkeys((JOINT, *own)))

    @cached_property
    def unweighted(self) -> JointProblem:
        """Which parameters there are, and which row belongs to what; its residuals have no meaning."""
        return JointProblem((*(instrument.problem for instrument in self.measured), *self.known), self.chosen)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.unweighted.parameters

    @property
    def assumed_factors(self) -> VarianceFactors:
        """Every source as large as assumed."""
        return as_assumed(len(self.sources))

    def problem(self, theta: Floats, factors: VarianceFactors | None = None) -> JointProblem:
        """The joint problem with weights from the noise at `theta` (param,), as assumed without `factors`."""
        size = self.assumed_factors if factors is None else factors
        blocks = [
            _weighted(instrument, self.unweighted.of_block(i, theta), self.joint_rad, self._sources_of(i), size)
            for i, instrument in enumerate(self.measured)
        ]
        shared = self._shared(theta)
        if shared is None:
            return JointProblem((*blocks, *self.known), self.chosen)
        seen = blocks[shared.witness]
        if seen.rows == 0:
            return JointProblem((*blocks, *self.known), self.chosen)
        form = np.linalg.inv(np.einsum("nji,njk->ik", seen.whitener, seen.whitener) / seen.rows)
        blocks = [_wider(block, shared.unseen(i, form)) for i, block in enumerate(blocks)]
        return JointProblem((*blocks, *self.known), self.chosen, Witnessed(shared, seen))

    def sharing(self, theta: Floats, factors: VarianceFactors) -> "Weighting":
        """The same with what second encoders share with the other instruments, found at an estimate."""
        witness = witness_of([m.problem.chain for m in self.measured])
        if witness is None or len(self.measured) == 1:
            return self
        problem, levers = self.problem(theta, factors), self._levers(theta)
        misfits = [m.problem.misfit(self.unweighted.of_block(i, theta)) for i, m in enumerate(self.measured)]
        whiteners = [block.whitener for block in problem.blocks if isinstance(block, Problem)]
        every = [np.arange(m.problem.rows) for m in self.measured]
        shares, sigmas = shares_found(misfits, levers, whiteners[: len(every)], every, witness)
        return replace(self, shares=shares, share_sigmas=sigmas)

    def shared_rad(self, factors: VarianceFactors) -> tuple[float, float]:
        """Joint repeatability that second encoders have taken out of the others' rows, rms of all joints, one sigma."""
        witness = witness_of([m.problem.chain for m in self.measured])
        if self.shares is None or self.share_sigmas is None or witness is None or not np.any(self.shares):
            return 0.0, 0.0
        (source, sigma), *_ = self.measured[witness].own_sigma.items()
        at, share = self.sources.index(source), float(np.sqrt(np.mean(self.shares**2)))
        by_share = float(np.linalg.norm(self.shares * self.share_sigmas)) / (len(self.shares) * share)
        size, spread = float(np.median(sigma) * factors.factor[at]), float(np.median(sigma) * factors.factor_sigma[at])
        return share * size, float(np.hypot(share * spread, by_share * size))

    def _levers(self, theta: Floats) -> tuple[Lever | None, ...]:
        by_joint = [
            m.problem.chain.by_joint(self.unweighted.of_block(i, theta), m.problem.q_rad)
            for i, m in enumerate(self.measured)
        ]
        chains, samples = [m.problem.chain for m in self.measured], [m.sample_rows for m in self.measured]
        found = levers_of(chains, samples, by_joint)
        return tuple(
            None if m.own_correlation is not None else lever for m, lever in zip(self.measured, found, strict=True)
        )

    def _shared(self, theta: Floats) -> SharedScatter | None:
        witness = witness_of([m.problem.chain for m in self.measured])
        if self.shares is None or witness is None:
            return None
        return SharedScatter(witness, self.shares, (*self._levers(theta), *(None for _ in self.known)))

    def noise(
        self, parameters: tuple[Parameter, ...], theta: Floats, start: VarianceFactors | None = None
    ) -> VarianceFactors:
        """Sizes of all sources by REML at an estimate; `parameters` state what was free and under a prior in the fit.

        `start`: what was found before, which saves steps.

        UndeterminedError where what is left free cannot be determined: hold it first (fit/rank/identifiability.py).
        """
        information, deviation, rows = self._linearised(parameters, theta)
        with self._naming(parameters):
            return variance.estimate(rows, len(self.sources), information, information * deviation, start)

    def dof(self, parameters: tuple[Parameter, ...], theta: Floats, factors: VarianceFactors) -> Floats:
        """(free,) Satterthwaite degrees of freedom of the variances of the free parameters."""
        information, _, rows = self._linearised(parameters, theta)
        with self._naming(parameters):
            return variance.dof(rows, information, factors)

    def _naming(self, parameters: tuple[Parameter, ...]) -> AbstractContextManager[None]:
        return naming_undetermined([p.name for p in parameters if p.free], self.measured[0].problem.q_rad)

    def take(self, samples: Indices) -> "Weighting":
        """The same instruments over these rows of the table of samples; parameters and known lengths stay."""
        cut = tuple(m.select(np.flatnonzero(np.isin(m.sample_rows, samples).all(axis=1))) for m in self.measured)
        return replace(self, measured=cut)

    def _sources_of(self, i: int) -> tuple[int, ...]:
        return tuple(self.sources.index(source) for source in (JOINT, *self.measured[i].own_sigma))

    def _linearised(
        self, parameters: tuple[Parameter, ...], theta: Floats
    ) -> tuple[Floats, Floats, tuple[NoisyRows, ...]]:
        """Prior information (free,), deviation from the prior (free,), and all rows."""
        free = np.flatnonzero([p.free for p in parameters])
        information = 1.0 / priors(parameters)[free] ** 2
        deviation = (theta - start_values(parameters))[free]
        jacobian, shared = self.unweighted.with_parameters(parameters), self._shared(theta)

        def linear(i: int, instrument: Measured) -> tuple[Floats, Floats]:
            problem, own = instrument.problem, jacobian.of_block(i, theta)
            return problem.misfit(own), jacobian.spread(i, problem.chain.jacobian(own, problem.q_rad))[..., free]

        witness = None if shared is None else linear(shared.witness, self.measured[shared.witness])
        rows: list[NoisyRows] = []
        for i, every in enumerate(self.measured):
            some = _thin(every)
            instrument = every if some is None else every.select(some)
            misfit, spread = linear(i, instrument)
            if shared is not None and witness is not None:
                misfit = shared.alone(i, misfit, witness[0], some)
                spread = shared.alone(i, spread, witness[1], some)
            parts = instrument.parts(jacobian.of_block(i, theta), self.joint_rad)
            rows.append(NoisyRows(misfit, spread, parts, self._sources_of(i)))
        for i, block in enumerate(self.known, start=len(self.measured)):
            own = jacobian.of_block(i, theta)
            spread = jacobian.spread(i, block.jacobian(own)[:, None])[..., free]
            one = np.ones((1, block.rows, 1, 1))
            rows.append(NoisyRows(block.residual(own)[:, None], spread, one, (FIXED,)))
        return information, deviation, tuple(rows)


def _weighted(
    measured: Measured, theta: Floats, joint_rad: float, sources: Sequence[int], factors: VarianceFactors
) -> Problem:
    """The problem with weights from the noise at `theta`; `sources` are those of joints, then of its own noise."""
    parts = measured.parts(theta, joint_rad)
    covariance = covariance_of(parts, sources, factors.log_variance)
    problem = measured.problem.with_covariance(covariance)
    if measured.own_correlation is None:
        return problem
    own = (covariance - covariance_of(parts[:1], sources[:1], factors.log_variance))[:, 0, 0]
    by_joint = measured.problem.chain.by_joint(theta, measured.problem.q_rad)[:, 0]
    n = measured.problem.chain.model.n_joints
    scale = joint_rad**2 * np.exp(factors.log_variance[sources[0]])
    by_joints = scale * np.einsum("ni,ni->n", by_joint[:-1, n:], by_joint[1:, :n])
    shared = by_joints + measured.own_correlation[:-1] * np.sqrt(own[:-1] * own[1:])
    shared = np.where(measured.sample_rows[:-1, 1] == measured.sample_rows[1:, 0], shared, 0.0)
    sigma = np.sqrt(covariance[:, 0, 0])
    return replace(problem, correlation=np.append(shared / (sigma[:-1] * sigma[1:]), 0.0))


def _thin(instrument: Measured) -> Indices | None:
    """Evenly spread rows, no more than ENOUGH; None: all of them."""
    n = instrument.problem.rows
    return None if n <= ENOUGH else np.linspace(0, n - 1, ENOUGH).astype(np.intp)


def _wider(problem: Problem, more: Floats | None) -> Problem:
    """With this covariance (row, k, k) added to that of its rows."""
    if more is None:
        return problem
    unwhitener = np.linalg.inv(problem.whitener)
    return problem.with_covariance(unwhitener @ np.swapaxes(unwhitener, 1, 2) + more)
