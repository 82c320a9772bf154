"""Dual-PSD problems by compiled loops: whitened rows by the free parameters, and their normal equations.

Rows run over the poses first: psd1_x of all, psd1_y of all, ... In memory they stand column by column.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.compiled import ArmConstants
from calibrate.arms.serial import SerialArm
from calibrate.chain import Chain
from calibrate.kernels.normal_equations import Normal, Scaled, upper
from calibrate.problem import Problem
from calibrate.sensors import laser
from calibrate.sensors.dual_psd import N_FIXED, PAIR_FIRST, DualPsd

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

JOINT_TWIST = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])  # a joint turns about z of the frame before it


@dataclass(frozen=True)
class DualPsdRows:
    """A Problem of a serial arm and a dual PSD, ready for the compiled loops."""

    problem: Problem
    arm: SerialArm
    sensor: DualPsd
    scaled: Scaled
    of_arm: Indices  # free columns of the arm
    of_sensor: Indices  # columns of the sensor that the loops make: laser, gains and pair where free, all places
    kept: Indices  # free ones among the columns of the loops: of the arm, of the sensor; and the residual
    q_rad: Floats  # (joint, pose)

    @classmethod
    def of(cls, problem: Problem) -> Self | None:
        """None where the problem is of another kind: another arm or instrument, rows that hang together.

        Also where PSD 2 in PSD 1 is free without a prior, which the sensor has no derivative for.
        """
        chain = problem.chain
        if not isinstance(chain, Chain) or not isinstance(chain.model, SerialArm):
            return None
        if not isinstance(chain.sensor, DualPsd) or problem.correlation is not None:
            return None
        scaled, n, q_rad = Scaled.of(problem.parameters), len(chain.model.parameters), problem.q_rad.T
        of_arm, free = scaled.free[scaled.free < n], scaled.free[scaled.free >= n] - n
        made = np.ones(len(problem.parameters) - n, dtype=bool)
        made[laser.N_PARAMETERS : PAIR_FIRST] = np.any((free >= laser.N_PARAMETERS) & (free < PAIR_FIRST))
        made[PAIR_FIRST:N_FIXED] = chain.sensor.pair_prior is not None
        if not np.all(made[free]):
            return None
        of_sensor = np.flatnonzero(made)
        kept = np.append(np.searchsorted(of_sensor, free), len(of_sensor)) + len(of_arm)
        kept = np.concatenate([np.arange(len(of_arm)), kept])
        return cls(problem, chain.model, chain.sensor, scaled, of_arm, of_sensor, kept, np.ascontiguousarray(q_rad))

    @property
    def residuals(self) -> int:
        """Data rows."""
        return 4 * self.problem.rows

    def weighted(self, whitener: Floats) -> Self:
        """The same with other weights (pose, 4, 4)."""
        return replace(self, problem=replace(self.problem, whitener=whitener))

    def normal(self, theta: Floats) -> Normal:
        """At theta (param,), in scaled columns with priors."""
        every = self._every(theta)
        squared = every @ every.T
        return self.scaled.normal(theta, squared[self.kept[:, None], self.kept])

    def normal_of(self, theta: Floats, triangle: Floats) -> Normal:
        """The same from a triangle of [J r] that was made at theta, of which J may have more free columns."""
        chosen = triangle[:, np.append(self.scaled.free, -1)]
        return self.scaled.normal(theta, chosen.T @ chosen)

    def rows(self, theta: Floats) -> Floats:
        """(4 pose, free + 1) whitened Jacobian and residual, without priors."""
        return self._every(theta)[self.kept].T

    def triangle(self, theta: Floats) -> Floats:
        """(at most free + 1, param + 1) R of the QR of [J r]; columns of held parameters are zero."""
        R = upper(self.rows(theta))
        out = np.zeros((len(R), len(theta) + 1))
        out[:, np.append(self.scaled.free, -1)] = R
        return out

    def by_joint(self, theta: Floats) -> Floats:
        """(pose, 4, joint) derivative of the spots by the joint angles, not whitened."""
        n, poses = self.q_rad.shape
        out = np.empty((n + 1, 4, poses))
        joints = replace(self._arm(theta), moves_frame=np.arange(n), body_twists=np.tile(JOINT_TWIST, (n, 1)))
        plain = np.tile(np.eye(4), (poses, 1, 1))
        nothing = np.empty((0, 2, 0, 6)), np.empty((0, 0), dtype=np.intp)
        self._run(theta, joints, np.empty((0, 3)), *nothing, plain, out)
        return np.ascontiguousarray(out[:n].transpose(2, 1, 0))

    def _every(self, theta: Floats) -> Floats:
        """(column, 4 pose) all columns of the loops."""
        columns = len(self.of_arm) + len(self.of_sensor) + 1
        out = np.zeros((columns, 4, self.problem.rows))
        arm = self._arm(theta).of_columns(self.of_arm)
        across = np.stack([self.sensor.mount.u, self.sensor.mount.v])
        self._run(theta, arm, across, *self._fixture(theta), self.problem.whitener, out)
        return out.reshape(columns, -1)

    def _arm(self, theta: Floats) -> ArmConstants:
        return ArmConstants.of(self.arm, theta[: len(self.arm.parameters)])

    def _phi(self, theta: Floats) -> Floats:
        return theta[len(self.arm.parameters) :]

    def _fixture(self, theta: Floats) -> tuple[Floats, Indices]:
        """Base twists (2 place, face, column, 6) by which the beam seems to move, and the columns they are for.

        Counted from the one after the laser's. The pair's where it is not held, then those of the place, by the
        opposite of which the beam moves.
        """
        sensor, phi = self.sensor, self._phi(theta)
        by_place = np.repeat(-np.swapaxes(sensor.place_twists(phi), 1, 2), 2, axis=0)  # for both orders
        seen = np.stack([by_place, by_place], axis=1)
        first = len(self.of_sensor) - 6 * len(sensor.places) - laser.N_PARAMETERS
        columns = first + 6 * (np.arange(len(seen)) // 2)[:, None] + np.arange(6)
        if sensor.pair_prior is not None:
            seen = np.concatenate([np.swapaxes(sensor.pair_motions(phi), 2, 3), seen], axis=2)
            pair = np.tile(first - 6 + np.arange(6), (len(columns), 1))
            columns = np.concatenate([pair, columns], axis=1)
        return np.ascontiguousarray(seen), columns

    def _run(
        self, theta: Floats, arm: ArmConstants, across: Floats, seen: Floats, columns: Indices, W: Floats, out: Floats
    ) -> None:
        from calibrate.kernels import dual_psd_loops

        sensor, phi = self.sensor, self._phi(theta)
        angle = self.q_rad + arm.offset_rad[:, None]
        dual_psd_loops.rows(
            arm.fixed,
            np.cos(angle),
            np.sin(angle),
            arm.moves_frame,
            arm.body_twists,
            *sensor.mount.in_flange(phi[: laser.N_PARAMETERS]),
            across,
            phi[laser.N_PARAMETERS : PAIR_FIRST],
            sensor.unfolded(phi),
            seen,
            columns,
            laser.N_PARAMETERS in self.of_sensor,
            sensor.group,
            np.ascontiguousarray(W),
            np.ascontiguousarray(self.problem.observed),
            out,
        )
