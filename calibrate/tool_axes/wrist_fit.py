"""Targets on the flange from the rows in which only the wrist turns, with the uncertainty that the arm's error adds.

Source: patent CN114523474B, step 3: the end effector alone is turned to several angles, and the target in the flange is
fitted by least squares to the distances of point pairs. The distances of all pairs fix the points up to a rigid motion,
so the same fit is made to the positions in a device frame that is free: then every row has noise of its own, and no
position is counted in many pairs. The arm's parameters are unknowns under their prior (generalised least squares with
prior information: Rao, Linear Statistical Inference, 2nd ed. 1973, ch. 4a), so the covariance holds what they add.

Where the measurement shows that the arm is farther off than its prior, the prior is widened, or refused. Two tests show
it: the wrist's rows determine how the last two axes lie to each other, hence some combinations of the arm's parameters,
whose size has a distribution under the prior; and the fit predicts the other rows, with a covariance.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.solvers import (
    FAR_START,
    NEAR_START,
    Fit,
    covariance_of,
    solve,
)
from calibrate.model.chain import KinematicModel, SensorChain
from calibrate.model.parameters import Parameter, index_of, start_values
from calibrate.model.placement import UNKNOWN_PLAUSIBLE_M, Device, Target
from calibrate.model.problem import Problem
from calibrate.model.rigid import inverse
from calibrate.model.sensors.full_pose import FullPose
from calibrate.model.sensors.position import Position
from calibrate.tool_axes.arm_prior import ArmPrior, PriorRows, free_parameters

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

LEAST_NOISE = 1e-9  # m, rad: below what any tracker resolves; exact data would have no finite weight
ROUNDS = 8  # of weights; the noise of the second is right to a per cent as a rule
SETTLED = 0.01  # of a noise, between two rounds: a hundredth of its own uncertainty at 10 rows would be less
WIDE = 30.0  # times the prior: where the noise is found; far beyond what is not refused
FIRST_TURN_RAD = 1e-3  # noise of an orientation in the first round; the residuals replace it


@dataclass(frozen=True)
class TargetRows:
    """Readings of one target: joints with positions in the device's frame, and orientations where it has them."""

    q_rad: Floats  # (row, joint)
    position_m: Floats  # (row, 3)
    rotation: Floats | None = None  # (row, 3, 3) R_device_target
    file_rows: Indices | None = None  # (row,) where they stand in the file, from 0; None: as they are
    number: int = 1  # the target's

    def select(self, rows: Indices) -> "TargetRows":
        """Some of the rows."""
        return TargetRows(
            self.q_rad[rows],
            self.position_m[rows],
            None if self.rotation is None else self.rotation[rows],
            self.in_file[rows],
            self.number,
        )

    @property
    def in_file(self) -> Indices:
        """(row,) place in the file, from 0."""
        return np.arange(len(self.q_rad)) if self.file_rows is None else self.file_rows


@dataclass(frozen=True)
class AxisNoise:
    """One sigma of a coordinate and of a turn about one axis, as the residuals show them."""

    position_m: float
    turn_rad: float


@dataclass(frozen=True)
class WristFit:
    """Values and covariance of arm, targets and device, in the order of `problem.parameters`."""

    arm: KinematicModel
    prior: ArmPrior
    problem: JointProblem  # whitened by `noise`; the last block is the prior
    fit: Fit
    noise: AxisNoise
    start_m: Floats  # (target, 3) that `target<k>.x`, y, z are about
    start_turn: Floats  # (target, 3, 3) that roll, pitch, yaw are about

    def columns(self, names: tuple[str, ...]) -> Indices:
        """Of these parameters in `theta`."""
        index = index_of(self.problem.parameters)
        return np.array([index[name] for name in names], dtype=np.intp)

    @property
    def data_rows(self) -> int:
        """Residuals of the measurement; those of the prior stand behind them."""
        return sum(int(block.row_widths.sum()) for block in self.problem.blocks if isinstance(block, Problem))

    def covariance_of_exact_arm(self) -> Floats:
        """(param, param) that the instrument's noise alone leaves; zero for the arm, nan where it does not exist."""
        n, first = len(self.problem.parameters), len(self.arm.parameters)
        own = covariance_of(self.problem.jacobian(self.fit.theta)[: self.data_rows, first:])
        out = np.zeros((n, n))
        out[first:, first:] = np.nan if own is None else own
        return out


def target_names(number: int) -> tuple[str, ...]:
    """Parameters of a target: its point, then its turn where orientations were measured."""
    return tuple(f"target{number}.{a}" for a in ("x", "y", "z", "roll", "pitch", "yaw"))


@dataclass(frozen=True)
class WristProblem:
    """What is fitted, and from where: targets, and the starts of their points and of the device."""

    arm: KinematicModel
    targets: tuple[TargetRows, ...]
    start_m: Floats  # (target, 3) in the flange
    start_turn: Floats  # (target, 3, 3) R_flange_target
    T_base_device: Floats  # (4, 4)

    @classmethod
    def of(
        cls, arm: KinematicModel, mean: Floats, targets: tuple[TargetRows, ...], start_m: Floats, T_base_device: Floats
    ) -> "WristProblem":
        """Orientations start where they are seen with the arm at `mean` (param,)."""
        turns = np.array([_start_turn(arm, mean, t, T_base_device) for t in targets])
        return cls(arm, targets, start_m, turns, T_base_device)

    def fit(self, prior: ArmPrior, noise: AxisNoise, begin: Floats | None = None) -> WristFit:
        """Least squares under the prior with these weights, from the start or from values `begin` (param,)."""
        parameters = free_parameters(self.arm, prior)
        blocks = tuple(self._block(k, parameters, noise) for k in range(len(self.targets)))
        problem = JointProblem((*blocks, PriorRows.of(prior, parameters)))
        if begin is None:
            fit = solve(problem, start=start_values(problem.parameters), damping=FAR_START)
        else:
            fit = solve(problem, start=begin, damping=NEAR_START)
        return WristFit(self.arm, prior, problem, fit, noise, self.start_m, self.start_turn)

    def noise(self, prior: ArmPrior, scatter_m: float) -> AxisNoise:
        """Of each kind of reading, from `scatter_m` on: residual sum of squares over degrees of freedom.

        These are rows less leverage (Foerstner's estimate, in which restricted maximum likelihood ends). The prior is
        taken wide here: what an arm beyond its prior misses must not pass for noise of the instrument.
        """
        wide = prior.scaled(WIDE)
        found = self.fit(wide, AxisNoise(max(scatter_m, LEAST_NOISE), FIRST_TURN_RAD))
        for _ in range(ROUNDS):
            if not np.all(np.isfinite(found.fit.covariance)):
                break
            after = _noise(found, self.targets)
            if _settled(found.noise, after):
                return after
            found = self.fit(wide, after, found.fit.theta)
        return found.noise

    def _block(self, k: int, parameters: tuple[Parameter, ...], noise: AxisNoise) -> Problem:
        target = self.targets[k]
        chain, observed = chain_of(self.arm, target, self.start_m[k], self.start_turn[k], self.T_base_device)
        own = chain.sensor.parameters
        n_target = len(own) - 6  # the device's six are shared
        names = target_names(target.number)[:n_target]
        renamed = tuple(replace(p, name=n) for p, n in zip(own[:n_target], names, strict=True))
        sigma = np.repeat([noise.position_m, noise.turn_rad], 3)[: observed.shape[1]]
        whitener = np.broadcast_to(np.diag(1.0 / sigma), (len(observed), len(sigma), len(sigma)))
        return Problem(chain, (*parameters, *renamed, *own[n_target:]), target.q_rad, observed, whitener)


def chain_of(
    arm: KinematicModel, target: TargetRows, point_m: Floats, turn: Floats, T_base_device: Floats
) -> tuple[SensorChain, Floats]:
    """The chain to a target's readings, and the readings (row, 3 or 6) as the sensor compares them."""
    device, about = Device(T_base_device), Target(point_m, UNKNOWN_PLAUSIBLE_M)
    if target.rotation is None:
        return SensorChain(arm, Position(about, device)), target.position_m
    sensor = FullPose(about, device, target.rotation, turn)
    return SensorChain(arm, sensor), np.concatenate([target.position_m, np.zeros_like(target.position_m)], axis=1)


def _start_turn(arm: KinematicModel, mean: Floats, target: TargetRows, T_base_device: Floats) -> Floats:
    """(3, 3) R_flange_target, mean over the rows; identity where no orientation was measured."""
    if target.rotation is None:
        return np.eye(3)
    R_device_flange = (inverse(T_base_device) @ arm.flange(mean, target.q_rad))[:, :3, :3]
    return Rotation.from_matrix(np.swapaxes(R_device_flange, 1, 2) @ target.rotation).mean().as_matrix()


def _noise(found: WristFit, targets: tuple[TargetRows, ...]) -> AxisNoise:
    theta, rows = found.fit.theta, found.data_rows
    residual = found.problem.residual(theta)[:rows]
    J = found.problem.jacobian(theta)[:rows]
    freedom = 1.0 - np.einsum("ij,jk,ik->i", J, found.fit.covariance, J)
    turn = np.concatenate([_is_turn(t) for t in targets])
    return AxisNoise(
        found.noise.position_m * _factor(residual[~turn], freedom[~turn], found.noise.position_m),
        found.noise.turn_rad * _factor(residual[turn], freedom[turn], found.noise.turn_rad),
    )


def _is_turn(target: TargetRows) -> NDArray[np.bool_]:
    """(residual,) whether it is of an orientation."""
    each = [False] * 3 if target.rotation is None else [False] * 3 + [True] * 3
    return np.tile(each, len(target.q_rad))


def _factor(residual: Floats, freedom: Floats, noise: float) -> float:
    if not residual.size:
        return 1.0
    return max(float(np.sqrt(residual @ residual / max(freedom.sum(), 1.0))), LEAST_NOISE / noise)


def _settled(before: AxisNoise, after: AxisNoise) -> bool:
    change = (after.position_m / before.position_m - 1.0, after.turn_rad / before.turn_rad - 1.0)
    return max(abs(c) for c in change) < SETTLED


# chance of an arm of the prior: below, the arm is taken to be farther off (as in report/elements/verdict.py)
UNLIKELY = 0.01
SEEN = 0.5  # share of a prior variance that the data remove from a combination: below, it is not a witness
MOST_ROWS = 200  # that are predicted with their full covariance, spread over all


@dataclass(frozen=True)
class SeenOverPrior:
    """Size of what is seen over what the prior expects: root of the mean square."""

    ratio: float
    chance: float  # of one as large, for an arm of the prior
    directions: float  # independent ones that it rests on

    @property
    def contradicts(self) -> bool:
        return self.ratio > 1.0 and self.chance < UNLIKELY


def wrist_witness(found: WristFit) -> SeenOverPrior | None:
    """The arm's estimated parameters against their prior; None where the wrist determines nothing of them.

    Of an arm of the prior the whitened estimates have the covariance 1 - C, with C the whitened posterior one.
    """
    prior_block = len(found.problem.blocks) - 1
    rows = found.problem.blocks[prior_block]
    if not rows.rows:
        return None
    whitener = rows.jacobian(found.fit.theta)
    u = rows.residual(found.problem.of_block(prior_block, found.fit.theta))
    columns = found.columns(tuple(p.name for p in rows.parameters))
    C = whitener @ found.fit.covariance[np.ix_(columns, columns)] @ whitener.T
    value, vector = np.linalg.eigh(np.eye(len(u)) - C)
    seen = value > SEEN
    k = int(seen.sum())
    if k == 0:
        return None
    q = float(np.sum((vector[:, seen].T @ u) ** 2 / value[seen]))
    return SeenOverPrior(float(np.sqrt(q / k)), float(chi2.sf(q, k)), float(k))


def other_rows_witness(
    found: WristFit, others: tuple[TargetRows, ...], T_base_device: Floats
) -> tuple[SeenOverPrior, float] | None:
    """Rows that took no part against their prediction, with the rms (m) of a coordinate; None without such rows.

    The sum of squares has the mean and variance of a chi-square with fewer degrees of freedom (Satterthwaite,
    Biometrics Bulletin 2(6), 1946), since few parameters of the arm move all rows.
    """
    off: list[Floats] = []
    by: list[Floats] = []
    for k, target in enumerate(others):
        if not len(target.q_rad):
            continue
        chosen = np.unique(np.linspace(0, len(target.q_rad) - 1, MOST_ROWS).astype(int))
        rows = target.select(chosen)
        chain, observed = chain_of(found.arm, rows, found.start_m[k], found.start_turn[k], T_base_device)
        own = found.problem.of_block(k, found.fit.theta)
        off.append((chain.expect(own, rows.q_rad) - observed)[:, :3].ravel())
        by.append(found.problem.spread(k, chain.jacobian(own, rows.q_rad)[:, :3].reshape(-1, len(own))))
    if not off:
        return None
    r, J = np.concatenate(off), np.concatenate(by)
    S = J @ found.fit.covariance @ J.T
    S[np.diag_indices(len(r))] += found.noise.position_m**2 + found.prior.fit_rms_m**2
    trace = float(np.trace(S))
    k = trace**2 / float(np.sum(S**2))
    square = float(r @ r) / trace
    return SeenOverPrior(float(np.sqrt(square)), float(chi2.sf(k * square, k)), k), float(np.sqrt(np.mean(r**2)))
