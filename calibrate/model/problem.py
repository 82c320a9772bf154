"""A weighted least-squares problem, and the rows of one instrument that it is made of.

Residuals are whitened so that noise is one. Noise of a row is joint repeatability mapped through the arm, G G' joint^2
with G the derivative by the readings, plus the instrument's own. How sizes of noise are found and rows weighted is a
matter of the fit (fit/weighting.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded

from calibrate.errors import UndeterminedError
from calibrate.model.chain import ObservationModel
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]
NEWTON_STEPS = 4  # from millimetres, nominal, to rounding: each squares what is left over the size of the arm
SINGULAR = 0.05  # of the quickest direction: a stretched arm leaves what it cannot follow, and does not leap
Indices = NDArray[np.intp]


class LeastSquares(Protocol):
    """What a solver and the identifiability analysis see. Priors and bounds are in `parameters`, not in the rows."""

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    def residual(self, theta: Floats) -> Floats:
        """(row,) whitened, expected minus observed."""
        ...

    def jacobian(self, theta: Floats) -> Floats:
        """(row, param) derivative of `residual` by every parameter, free or not."""
        ...


class Block(LeastSquares, Protocol):
    """One instrument's rows: a LeastSquares of its own that can be cut. Each row has the same number of residuals."""

    @property
    def rows(self) -> int:
        """Observation rows: poses, pairs or known lengths; residuals stand row by row."""
        ...

    @property
    def log_det_noise(self) -> float:
        """Logarithm of the determinant of the covariance of all its residual values, in the units of the readings."""
        ...

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same block over some of its rows."""
        ...


@dataclass(frozen=True)
class Problem:
    """Chain against data. `parameters` may hold or bound what the chain leaves free."""

    chain: ObservationModel
    parameters: tuple[Parameter, ...]
    q_rad: Floats  # (pose, joint); of pair observations both poses side by side, (pair, 2 joint)
    observed: Floats  # (pose, k)
    whitener: Floats  # (pose, k, k) W with W cov W' = 1
    correlation: Floats | None = None  # (row,) where k is 1: of each row's noise with the next row's; the last is 0
    condition: bool = False  # observed are not readings but what has to hold, such as tip less seat is zero

    @property
    def rows(self) -> int:
        """Poses, or pairs of poses: what `select` chooses from."""
        return len(self.q_rad)

    @property
    def row_widths(self) -> NDArray[np.intp]:
        """(pose,) residual values of each: they are of one observation, for a robust loss."""
        return np.full(self.rows, self.observed.shape[1], dtype=np.intp)

    @property
    def log_det_noise(self) -> float:
        """Logarithm of the determinant of the covariance of all rows, as whitened; inf without weights."""
        whitened = -2.0 * float(np.sum(np.linalg.slogdet(self.whitener)[1]))
        if self.correlation is None or self.rows < 2:
            return whitened
        factor = cholesky_banded(np.stack([np.ones(self.rows), self.correlation]), lower=True)
        return whitened + 2.0 * float(np.sum(np.log(factor[0])))

    def residual(self, theta: Floats) -> Floats:
        rows = np.einsum("nij,nj->ni", self.whitener, self.misfit(theta)).ravel()
        return rows if self.correlation is None else decorrelated(rows, self.correlation)

    def jacobian(self, theta: Floats) -> Floats:
        rows = (self.whitener @ self.chain.jacobian(theta, self.q_rad)).reshape(-1, len(self.parameters))
        return rows if self.correlation is None else decorrelated(rows, self.correlation)

    def misfit(self, theta: Floats) -> Floats:
        """(pose, k) expected minus observed, in the sensor's unit."""
        return self.chain.expect(theta, self.q_rad) - self.observed

    def with_parameters(self, parameters: tuple[Parameter, ...]) -> "Problem":
        return replace(self, parameters=parameters)

    def with_covariance(self, covariance: Floats) -> "Problem":
        """Weights from the covariance (pose, k, k) of the noise."""
        return replace(self, whitener=whitener_of(covariance))

    def select(self, rows: NDArray[np.intp]) -> "Problem":
        """The same problem over some of the poses."""
        kept = None
        if self.correlation is not None:  # what was next to each other still is, or is taken as independent
            kept = self.correlation[rows] * np.append(np.diff(rows) == 1, False)
        return replace(
            self,
            chain=self.chain.select(rows),
            q_rad=self.q_rad[rows],
            observed=self.observed[rows],
            whitener=self.whitener[rows],
            correlation=kept,
        )

    def fulfilled(self, theta: Floats) -> "Problem":
        """Rank is to be judged here: a condition at the nearest joint readings that fulfil it; readings as they are.

        What moves everything alike (a turn about axis 1 with all seats) turns what is left of a condition as well, and
        the derivative by it would resemble information; where nothing is left there is none.
        """
        if not self.condition:
            return self
        return replace(self, q_rad=self.chain.readings_for(theta, self.q_rad, self.observed, SINGULAR, NEWTON_STEPS))


def whitener_of(covariance: Floats) -> Floats:
    """(..., k, k) inverse of the lower Cholesky factor of a covariance. UndeterminedError for what is none."""
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise UndeterminedError(
            "the readings and this rig cannot be weighed together: expected readings are out of all proportion; "
            "check the lengths and angles of the rig file, and their units"
        ) from error


def decorrelated(rows: Floats, correlation: Floats) -> Floats:
    """Rows (row, ...) of unit noise, each correlated with its neighbour (row,), made independent: inverse Cholesky."""
    if len(rows) < 2:
        return rows
    factor = cholesky_banded(np.stack([np.ones(len(rows)), correlation]), lower=True)
    return np.asarray(solve_banded((1, 0), factor, rows), dtype=np.float64)


@dataclass(frozen=True)
class Measured:
    """One instrument's rows. `problem` need not be weighted yet."""

    name: str  # "position", "dual-psd", ...
    problem: Problem
    own_sigma: Mapping[str, Floats]  # source -> (row, k) as assumed, zero where the source does not reach
    sample_rows: Indices  # (row, 1) or (row, 2): rows of the table of samples that each row was made of
    own_correlation: Floats | None = None  # (row,) of pairs: of its own noise with the next row's, if they share a pose

    def parts(self, theta: Floats, joint_rad: float) -> Floats:
        """(1 + source, row, k, k) covariance by joints, then by each own source, at the assumed sizes."""
        by_joint = self.problem.chain.by_joint(theta, self.problem.q_rad)
        each = [parts_of(by_joint, joint_rad, sigma) for sigma in self.own_sigma.values()]
        return np.stack([each[0][0], *(part[1] for part in each)])

    def select(self, rows: Indices) -> "Measured":
        """Some of the rows."""
        own = {source: sigma[rows] for source, sigma in self.own_sigma.items()}
        chained = None if self.own_correlation is None else self.own_correlation[rows]
        return replace(
            self,
            problem=self.problem.select(rows),
            own_sigma=own,
            sample_rows=self.sample_rows[rows],
            own_correlation=chained,
        )

    @property
    def encoder_channels(self) -> Indices | None:
        """(channel,) joints, from 0, that second encoders are read at; None: another instrument."""
        joints = self.problem.chain.sensor.joints_compared()
        return np.array(joints, dtype=np.intp) - 1 if joints else None


def parts_of(by_joint: Floats, joint_rad: float, own_sigma: Floats) -> Floats:
    """(2, row, k, k) covariance by joints, from d reading / d joints, and by the instrument's own sigmas (row, k)."""
    arm = joint_rad**2 * by_joint @ np.swapaxes(by_joint, 1, 2)
    own = np.zeros_like(arm)
    each = range(own_sigma.shape[1])
    own[:, each, each] = own_sigma**2
    return np.stack([arm, own])
