"""Tracker problems by compiled loops: whitened rows, or their normal equations without ever holding the rows."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from calibrate.arms.serial import SerialArm
from calibrate.chain import Chain
from calibrate.kernels.serial import ArmConstants
from calibrate.parameters import plausible_sizes, priors, start_values
from calibrate.problem import Problem
from calibrate.rigid import pose_offset_twists
from calibrate.sensors.position import Position

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

TILE = 4  # the normal matrix is kept a multiple of it wide (compiled.py)
CHUNK_POSES = 8192  # rows held at a time where rows are needed: 6 MB for 30 columns


@dataclass(frozen=True)
class Normal:
    """Normal equations at one point, in columns scaled by plausible sizes; priors are in."""

    matrix: Floats  # (free, free)
    gradient: Floats  # (free,)
    chi2: float


@dataclass(frozen=True)
class PositionRows:
    """A Problem of a serial arm and a position instrument, ready for the compiled loops."""

    problem: Problem
    arm: SerialArm
    sensor: Position
    of_arm: Indices  # free columns of the arm
    free: Indices  # free columns of theta
    kept: Indices  # the same among the columns of the kernel: free ones of the arm, tool 3, device 6
    scale: Floats  # (free,)
    centre: Floats  # (free,) start values, which priors pull to
    information: Floats  # (free,) of the priors in scaled columns, 0 where there is none
    q_rad: Floats
    observed_m: Floats
    whitener: Floats

    @classmethod
    def of(cls, problem: Problem) -> Self | None:
        """None where the problem is of another kind: another arm, another instrument."""
        chain = problem.chain
        if not isinstance(chain, Chain) or not isinstance(chain.model, SerialArm):
            return None
        if not isinstance(chain.sensor, Position):
            return None
        free = np.flatnonzero([p.free for p in problem.parameters])
        n = len(chain.model.parameters)
        of_arm = free[free < n]
        kept = np.concatenate([np.arange(len(of_arm)), free[free >= n] - n + len(of_arm)])
        scale = plausible_sizes(problem.parameters)[free]
        return cls(
            problem,
            chain.model,
            chain.sensor,
            of_arm,
            free,
            kept,
            scale,
            start_values(problem.parameters)[free],
            (scale / priors(problem.parameters)[free]) ** 2,
            *(np.ascontiguousarray(a) for a in (problem.q_rad, problem.observed, problem.whitener)),
        )

    def normal(self, theta: Floats) -> Normal:
        """At theta (param,). Memory does not grow with the poses."""
        columns = len(self.of_arm) + 10
        wide = TILE * -(-columns // TILE)
        out = np.zeros((wide, wide))
        self._run(theta, slice(None), out, add_up=True)
        lower = out[:columns, :columns]
        return self._with_priors(theta, np.tril(lower) + np.tril(lower, -1).T, self.kept)

    def normal_of(self, theta: Floats, triangle: Floats) -> Normal:
        """The same from a triangle of [J r] that was made at theta, of which J may have more free columns."""
        kept = np.append(self.free, -1)
        chosen = triangle[:, kept]
        return self._with_priors(theta, chosen.T @ chosen, np.arange(len(self.free)))

    def rows(self, theta: Floats, poses: slice) -> Floats:
        """(row, free + 1) whitened Jacobian and residual of some poses, without priors; column by column in memory.

        Rows run over the poses first: all x, all y, all z.
        """
        columns, count = len(self.of_arm) + 10, len(self.q_rad[poses])
        out = np.empty((3 * columns, count))
        self._run(theta, poses, out, add_up=False)
        by_column = out.reshape(columns, 3 * count)
        return (by_column if len(self.kept) == columns - 1 else by_column[np.append(self.kept, columns - 1)]).T

    def triangle(self, theta: Floats) -> Floats:
        """(at most free + 1, param + 1) R of the QR of [J r] over all poses; columns of held parameters are zero.

        A chunk at a time on top of what came before. Source: Golub, Van Loan, Matrix Computations, 4th ed. 2013, ch.
        5.2 and 6.5 (QR, and its updating by rows).
        """
        upper = np.empty((0, len(self.free) + 1))
        for first in range(0, len(self.q_rad), CHUNK_POSES):
            chunk = self.rows(theta, slice(first, first + CHUNK_POSES))
            upper = _upper(np.concatenate([upper, chunk]) if len(upper) else chunk)
        out = np.zeros((len(upper), len(theta) + 1))
        out[:, np.append(self.free, -1)] = upper
        return out

    def _with_priors(self, theta: Floats, full: Floats, kept: Indices) -> Normal:
        """`full` (column, column) is [J r]'[J r], its last column the residual's."""
        deviation = (theta[self.free] - self.centre) / self.scale
        matrix = full[kept[:, None], kept] * (self.scale[:, None] * self.scale)
        matrix.flat[:: len(kept) + 1] += self.information
        pull = self.information * deviation
        return Normal(matrix, full[kept, -1] * self.scale + pull, float(full[-1, -1] + pull @ deviation))

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
            self.sensor.device.T_base_device_at(device),
            np.ascontiguousarray(pose_offset_twists(self.sensor.device.T_base_device, device).T),
            self.q_rad[poses],
            self.observed_m[poses],
            self.whitener[poses],
            out,
            add_up,
        )


def _upper(rows: Floats) -> Floats:
    """R of the QR by LAPACK itself: numpy's would copy what already lies column by column."""
    geqrf = lapack.dgeqrf  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    raw = geqrf(rows, lwork=32 * rows.shape[1], overwrite_a=True)[0]
    return np.triu(raw[: rows.shape[1]])
