"""Fast identification from tracked positions: what the data see first, then damped least squares on normal equations.

The same algorithm, statuses and figures as calibrate.solvers; only the rows are never held (normal_fit.py), so that
cost is linear and memory constant in the poses.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.identifiability import Identifiability, analyse
from calibrate.joint_problem import JointProblem
from calibrate.kernels import ready
from calibrate.kernels.normal_fit import bounded, fit_normal
from calibrate.kernels.position_rows import PositionRows
from calibrate.parameters import Parameter, start_values
from calibrate.problem import LeastSquares, Problem
from calibrate.redundant import Redundant, reduced
from calibrate.solvers.levenberg import FAR_START, NEAR_START, LevenbergRules
from calibrate.solvers.result import Fit
from calibrate.solvers.solve import solve

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Identified:
    """What the data see at the start, and the fit with the rest held."""

    seen: Identifiability | None  # None where the start is not finite, which the fit says
    fit: Fit


def positions_of(problem: LeastSquares) -> Problem | None:
    """The problem where it is positions by a serial arm and nothing else, and the compiled loops are to serve it."""
    whole = problem
    if isinstance(problem, JointProblem) and len(problem.blocks) == 1 and isinstance(problem.blocks[0], Problem):
        whole = problem.blocks[0].with_parameters(problem.parameters)  # one block: its order is that of all
    if not isinstance(whole, Problem) or not ready.worth(whole.rows) or PositionRows.of(whole) is None:
        return None
    return whole


def short_jacobian(problem: LeastSquares, theta: Floats, parameters: tuple[Parameter, ...]) -> Floats:
    """(row, param) with the J'J of the problem's Jacobian by the free `parameters`, in no more rows than need be.

    For `identifiability.analyse`; where the compiled loops serve, columns of the others are zero.
    """
    positions = positions_of(problem)
    if positions is None:
        return problem.jacobian(theta)
    return _rows_of(positions.with_parameters(parameters)).triangle(theta)[:, :-1]


def identify_positions(
    problem: Problem,
    *,
    start: Floats | None = None,
    damping: float = NEAR_START,
    redundant: Redundant = Redundant.REMOVED,
) -> Identified:
    """Rank at `start` (param,), nominal if None; what is unseen there held or believed; then the fit.

    The rank is full by then, so NEAR_START is safe as damping. DataError unless the problem is a serial arm with a
    position instrument and has poses.
    """
    theta = start_values(problem.parameters) if start is None else start
    triangle = _rows_of(problem).triangle(theta)
    if not np.all(np.isfinite(triangle)):
        return Identified(None, fit_positions(problem, start=theta, damping=damping))
    seen = analyse(triangle[:, :-1], problem.parameters)
    held = problem.with_parameters(reduced(problem.parameters, seen, redundant))
    if bounded(held.parameters):
        return Identified(seen, solve(held, start=theta, damping=damping))
    rows = _rows_of(held)
    return Identified(seen, fit_normal(rows, theta, rows.normal_of(theta, triangle), LevenbergRules(damping)))


def fit_positions(
    problem: Problem,
    *,
    start: Floats | None = None,
    damping: float = FAR_START,
    max_steps: int = 100,
    tolerance: float = 1e-8,
) -> Fit:
    """As calibrate.solvers.solve, which also does the work where parameters have bounds. DataError as above."""
    rows = _rows_of(problem)
    if bounded(problem.parameters):
        return solve(problem, start=start, damping=damping, max_steps=max_steps, tolerance=tolerance)
    theta = start_values(problem.parameters) if start is None else start
    return fit_normal(rows, theta, rows.normal(theta), LevenbergRules(damping, max_steps, tolerance))


def _rows_of(problem: Problem) -> PositionRows:
    rows = PositionRows.of(problem)
    if rows is None:
        raise DataError(
            "positions: the problem is not a serial arm with a position instrument; use calibrate.fit.solve"
        )
    if problem.rows == 0:
        raise DataError("positions: no poses at all; record settled samples with x_m, y_m, z_m")
    return rows
