"""Rows whose noise comes from several sources, and the same rows turned until every source is independent there.

Row j of an instrument has covariance sum_c factor_c part_cj. Two parts of a row are made diagonal together: with
L L' = A + B and U M U' = L^-1 A L^-T, the row turned by U' L^-1 has parts M and 1 - M, whatever the factors. Source:
Golub, Van Loan, Matrix Computations, 4th ed. 2013, ch. 8.7.1 (the symmetric-definite generalised eigenproblem).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.problem import whitener_of

Floats = NDArray[np.float64]

FIXED = -1  # source of a part that is as large as stated, such as the sigma on a certificate


@dataclass(frozen=True)
class NoisyRows:
    """One instrument's rows, linearised with the free parameters of the whole fit."""

    misfit: Floats  # (row, k)
    jacobian: Floats  # (row, k, param)
    parts: Floats  # (part, row, k, k) covariance at the assumed sizes
    sources: tuple[int, ...]  # which source each part belongs to, counted over all instruments, each once; or FIXED


@dataclass(frozen=True)
class IndependentRows:
    """Rows of one coordinate each, independent of one another under every source."""

    misfit: Floats  # (row,)
    jacobian: Floats  # (row, param)
    parts: Floats  # (part, row) variances at the assumed sizes
    sources: tuple[int, ...]


def covariance_of(parts: Floats, sources: Sequence[int], log_variance: Floats) -> Floats:
    """(row, k, k) sum of the parts (part, row, k, k), each times the variance factor of its source."""
    return np.einsum("k,knij->nij", factors_of(sources, log_variance), parts)


def factors_of(sources: Sequence[int], log_variance: Floats) -> Floats:
    """(part,) by what the assumed variance of each part is multiplied."""
    return np.exp(np.append(log_variance, 0.0)[list(sources)])  # FIXED is the last: factor 1


def independent(rows: NoisyRows | IndependentRows) -> NoisyRows | IndependentRows:
    """The rows turned, where one coordinate or one or two parts allow it; otherwise as they are."""
    if isinstance(rows, IndependentRows):
        return rows
    n, k = rows.misfit.shape
    if k == 1:
        return IndependentRows(rows.misfit[:, 0], rows.jacobian[:, 0], rows.parts[:, :, 0, 0], rows.sources)
    if len(rows.parts) > 2:
        return rows
    turn, share = common_axes(rows.parts)
    misfit = np.einsum("nij,nj->ni", turn, rows.misfit).reshape(-1)
    return IndependentRows(misfit, (turn @ rows.jacobian).reshape(n * k, -1), share, rows.sources)


def common_axes(parts: Floats) -> tuple[Floats, Floats]:
    """(row, k, k) turns, and the (part, row * k) variances after them, for one or two parts (part, row, k, k).

    DataError where the noise of a row leaves one of its coordinates exact.
    """
    total = parts.sum(axis=0)
    try:
        whitener = whitener_of(total)
    except np.linalg.LinAlgError:
        worst = int(np.argmin(np.linalg.eigvalsh(total)[:, 0]))
        raise DataError(
            f"reading {worst + 1} of those fitted cannot be weighed: the noise of its coordinates is "
            "not positive definite; check the joint angles and readings of its row, and the noise stated in the rig"
        ) from None
    if len(parts) == 1:
        return whitener, np.ones((1, parts.shape[1] * parts.shape[2]))
    share, axes = np.linalg.eigh(whitener @ parts[0] @ np.swapaxes(whitener, 1, 2))
    share = np.clip(share, 0.0, 1.0).reshape(-1)
    return np.swapaxes(axes, 1, 2) @ whitener, np.stack([share, 1.0 - share])
