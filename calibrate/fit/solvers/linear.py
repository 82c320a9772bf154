"""Linear algebra that the solvers share: damped and minimum-norm steps, and the covariance."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular

Floats = NDArray[np.float64]

SINGULAR = 1e-11  # of the largest: below, columns are taken as dependent; rounding of whitened rows leaves about 1e-13
PANEL = 8  # columns that a QR takes at a time: measured best of 4, 8, 12, 16 and all
LEAST_RIDGE = 1e-15  # of the largest diagonal element: keeps an "undamped" step finite, changes no visible digit


def damped_step(normal: Floats, gradient: Floats, damping: float) -> Floats:
    """Step of the damped normal equations, -(N + damping max(diag N) 1)^-1 g, for (free, free) and (free,).

    The ridge in scaled columns keeps combinations that the data cannot see where they are. ArithmeticError where N is
    not finite.
    """
    if len(gradient) == 0:
        return np.zeros(0)
    if not (np.all(np.isfinite(normal)) and np.all(np.isfinite(gradient))):
        raise ArithmeticError(f"normal equations of {len(gradient)} parameters are not finite; check weights")
    ridge = max(damping, LEAST_RIDGE) * float(np.max(np.diag(normal)))
    for _ in range(60):
        damped = np.array(normal, order="F")
        damped.ravel("K")[:: len(gradient) + 1] += ridge
        step, indefinite = _by_cholesky(damped, gradient)
        if not indefinite:
            return -step
        ridge *= 10.0  # rounding made it indefinite
    raise ArithmeticError(f"normal equations of {len(gradient)} parameters stay indefinite; check weights")


def _by_cholesky(matrix: Floats, right: Floats) -> tuple[Floats, bool]:
    """Solution x (n,) of matrix x = right, and whether the matrix, which is overwritten, is not positive definite.

    LAPACK itself: scipy's faces of it cost four times what the work does at 30 unknowns.
    """
    dposv = lapack.dposv  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    _, solution, info = dposv(matrix, right, lower=True, overwrite_a=True)
    return solution.reshape(len(right)), info != 0


def promised_gain(normal: Floats, gradient: Floats) -> float:
    """Decrease of the sum of squares that an (almost) undamped step promises."""
    return float(-gradient @ damped_step(normal, gradient, 0.0)) if len(gradient) else 0.0


def triangle_of(rows: Floats) -> Floats:
    """(min(row, column), column) R of the QR of rows (row, column): the same J'J in no more rows than need be.

    LAPACK itself, by panels and recursively: five times faster than numpy's for tall rows. Source: Elmroth, Gustavson,
    IBM J. Res. Dev. 44(4), 2000.
    """
    if 0 in rows.shape:
        return np.zeros((0, rows.shape[1]))
    geqrt = lapack.dgeqrt  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    raw = geqrt(min(PANEL, *rows.shape), np.array(rows, order="F"), overwrite_a=True)[0]
    return np.triu(raw[: rows.shape[1]])


def gauss_newton_step(slope: Floats, residual: Floats) -> Floats:
    """(free,) shortest h that minimises |J h + e|: what the data cannot see is left where it is.

    By QR of [J e], then singular values of the small triangle (Golub, Van Loan, Matrix Computations, 4th ed., 5.5.5).
    """
    if slope.shape[1] == 0:
        return np.zeros(0)
    triangle = triangle_of(np.column_stack([slope, residual]))
    n = slope.shape[1]
    shortest = np.linalg.lstsq(triangle[:, :n], -triangle[:, n], rcond=SINGULAR)[0]
    return np.asarray(shortest, dtype=np.float64)


def covariance_of(J: Floats) -> Floats | None:
    """(J'J)^-1 by QR, which does not square the condition; None when the columns are dependent."""
    if J.shape[1] == 0:
        return np.zeros((0, 0))
    if J.shape[0] < J.shape[1]:
        return None
    R = triangle_of(J)
    diagonal = np.abs(np.diag(R))
    if not np.all(np.isfinite(R)) or diagonal.min() <= SINGULAR * diagonal.max():
        return None
    inverse = solve_triangular(R, np.eye(len(R)))
    return inverse @ inverse.T
