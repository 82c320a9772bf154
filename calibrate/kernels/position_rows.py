"""Tracker problems by compiled loops: whitened rows, or their normal equations without ever holding the rows."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.serial import SerialArm
from calibrate.chain import Chain
from calibrate.kernels.normal_equations import Normal, Scaled, upper
from calibrate.kernels.serial import ArmConstants
from calibrate.problem import Problem
from calibrate.sensors.position import Position

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.intp]

TILE = 4  # the normal matrix is kept a multiple of it wide (compiled.py)
CHUNK_POSES = 8192  # rows held at a time where rows are needed: 6 MB for 30 columns


@dataclass(frozen=True)
class PositionRows:
    """A Problem of a serial arm and a position instrument, ready for the compiled loops."""

    arm: SerialArm
    sensor: Position
    of_arm: Indices  # free columns of the arm
    scaled: Scaled
    kept: Indices  # free columns among those of the kernel: free ones of the arm, tool 3, device 6
    q_rad: Floats
    observed_m: Floats
    whitener: Floats

    @classmethod
    def of(cls, problem: Problem) -> Self | None:
        """None where the problem is of another kind: another arm, another instrument, rows that hang together."""
        chain = problem.chain
        if not isinstance(chain, Chain) or not isinstance(chain.model, SerialArm):
            return None
        if not isinstance(chain.sensor, Position) or problem.correlation is not None:
            return None
        scaled = Scaled.of(problem.parameters)
        n = len(chain.model.parameters)
        of_arm, others = scaled.free[scaled.free < n], scaled.free[scaled.free >= n]
        kept = np.concatenate([np.arange(len(of_arm)), others - n + len(of_arm)])
        return cls(
            chain.model,
            chain.sensor,
            of_arm,
            scaled,
            kept,
            *(np.ascontiguousarray(a) for a in (problem.q_rad, problem.observed, problem.whitener)),
        )

    @property
    def residuals(self) -> int:
        return 3 * len(self.q_rad)

    def normal(self, theta: Floats) -> Normal:
        """At theta (param,). Memory does not grow with the poses."""
        columns = len(self.of_arm) + 10
        wide = TILE * -(-columns // TILE)
        out = np.zeros((wide, wide))
        self._run(theta, slice(None), out, add_up=True)
        lower = out[self._kept_and_residual[:, None], self._kept_and_residual]
        return self.scaled.normal(theta, np.where(self._is_lower, lower, lower.T))

    def normal_of(self, theta: Floats, triangle: Floats) -> Normal:
        """The same from a triangle of [J r] that was made at theta, of which J may have more free columns."""
        chosen = triangle[:, np.append(self.scaled.free, -1)]
        return self.scaled.normal(theta, chosen.T @ chosen)

    def rows(self, theta: Floats, poses: slice) -> Floats:
        """(row, free + 1) whitened Jacobian and residual of some poses, without priors; column by column in memory.

        Rows run over the poses first: all x, all y, all z.
        """
        columns, count = len(self.of_arm) + 10, len(self.q_rad[poses])
        out = np.empty((3 * columns, count))
        self._run(theta, poses, out, add_up=False)
        by_column = out.reshape(columns, 3 * count)
        return (by_column if len(self.kept) == columns - 1 else by_column[self._kept_and_residual]).T

    def triangle(self, theta: Floats) -> Floats:
        """(at most free + 1, param + 1) R of the QR of [J r] over all poses; columns of held parameters are zero.

        A chunk at a time on top of what came before. Source: Golub, Van Loan, Matrix Computations, 4th ed. 2013, ch.
        5.2 and 6.5 (QR, and its updating by rows).
        """
        found = np.empty((0, len(self.kept) + 1))
        for first in range(0, len(self.q_rad), CHUNK_POSES):
            chunk = self.rows(theta, slice(first, first + CHUNK_POSES))
            found = upper(np.concatenate([found, chunk]) if len(found) else chunk)
        out = np.zeros((len(found), len(theta) + 1))
        out[:, np.append(self.scaled.free, -1)] = found
        return out

    @cached_property
    def _kept_and_residual(self) -> Indices:
        return np.append(self.kept, len(self.of_arm) + 9)

    @cached_property
    def _is_lower(self) -> Bools:
        return np.tri(len(self.kept) + 1, dtype=np.bool_)

    def _run(self, theta: Floats, poses: slice, out: Floats, *, add_up: bool) -> None:
        from calibrate.kernels import compiled

        n = len(self.arm.parameters)
        arm = ArmConstants.of(self.arm, theta[:n]).of_columns(self.of_arm)
        tool, device = theta[n : n + 3], theta[n + 3 : n + 9]
        compiled.position_rows(
            arm.fixed,
            arm.offset_rad,
            arm.moves_frame,
            arm.body_twists,
            self.sensor.target.point_m + tool,
            self.sensor.device.T_base_device,
            device,
            self.q_rad[poses],
            self.observed_m[poses],
            self.whitener[poses],
            out,
            add_up,
        )
