"""Restricted likelihood (REML) of the sizes of several sources of noise, with its derivatives.

Row j of an instrument has covariance sum_c factor_c part_cj. Two parts of a row are made diagonal together: with
L L' = A + B and U M U' = L^-1 A L^-T, the row turned by U' L^-1 has parts M and 1 - M, whatever the factors. Source:
Golub, Van Loan, Matrix Computations, 4th ed. 2013, ch. 8.7.1 (the symmetric-definite generalised eigenproblem).

Slope and curvature by the log variance of each source: with whitened rows (y, Y), normal matrix L L' = Y'Y + priors,
Z = Y L'^-1, shares B_c of the sources (with the fixed ones they sum to one), e = y + Y shift the residual of the best
fit, and P = 1 - Z Z':
  slope_c = (e'B_c e - tr P B_c) / 2,  expected curvature_cd = tr(P B_c P B_d) / 2,
  observed curvature_cd = e'B_c P B_d e - expected_cd - (slope_c where c = d).
Sources: Searle, Casella, McCulloch, Variance Components, 1992, ch. 6.6 (score, expected information); the observed one
is the chain rule from variances to their logarithms on Gilmour, Thompson, Cullis, Biometrics 51, 1995, eq. (3), (4).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, cho_solve, solve_triangular

from calibrate.errors import DataError, UndeterminedError
from calibrate.model.problem import whitener_of

Floats = NDArray[np.float64]
FIXED = -1  # source of a part that is as large as stated, such as the sigma on a certificate
LOST = 1e-5  # of a column's length: Cholesky of the square has six digits left of such a pivot
DEPENDENT = 1e-12  # of a column's length: rounding of whitened rows leaves about 1e-13


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


@dataclass(frozen=True)
class Score:
    """At one log variance of every source, priors of the log variances not counted."""

    gradient: Floats  # (source,)
    expected: Floats  # (source, source) information
    observed: Floats  # (source, source) information; indefinite where the likelihood is not concave
    spread: Floats  # (source, param, param) sum of Z' B_c Z
    factor: Floats  # (param, param) L, in the parameters' own units

    def sensitivity(self) -> Floats:
        """(param, source) derivative of each posterior variance by log variance."""
        back = solve_triangular(self.factor, np.eye(len(self.factor)), lower=True).T
        return np.einsum("cij,ij->ic", back @ self.spread, back)

    def posterior_variance(self) -> Floats:
        """(param,) diagonal of the inverse of the normal matrix."""
        return np.sum(solve_triangular(self.factor, np.eye(len(self.factor)), lower=True) ** 2, axis=0)


@dataclass(frozen=True)
class _Terms:
    """What one instrument adds."""

    spread: Floats  # (part, param, param)
    weighted: Floats  # (part, row) B_c e
    traces: Floats  # (part,) tr B_c
    products: Floats  # (part, part) tr B_c B_d - 2 tr Z' B_c B_d Z


@dataclass(frozen=True)
class _Shares:
    """Independent rows, whitened."""

    y: Floats  # (row,)
    Y: Floats  # (row, param)
    B: Floats  # (part, row)
    sources: list[int]
    whole: bool  # the shares of a row add up to 1: no source is as large as stated

    def terms(self, e: Floats, Z: Floats, square: Floats | None) -> _Terms:
        """From the residual of the best fit, Z (row, param), and Z'Z where it is known."""
        leverage = np.einsum("np,np->n", Z, Z)
        asked = self.B[:-1] if self.whole else self.B
        spread = [part.T @ part for part in (root[:, None] * Z for root in np.sqrt(asked))]
        if self.whole:
            spread.append((Z.T @ Z if square is None else square) - sum(spread))
        return _Terms(np.stack(spread), self.B * e, self.B.sum(axis=1), (self.B * (1.0 - 2.0 * leverage)) @ self.B.T)


@dataclass(frozen=True)
class _BlockShares:
    """Rows of several coordinates that no turn makes independent, whitened; flat but for the shares."""

    y: Floats  # (row * k,)
    Y: Floats  # (row * k, param)
    B: Floats  # (part, row, k, k)
    sources: list[int]

    def terms(self, e: Floats, Z: Floats, _square: Floats | None) -> _Terms:
        """From the residual of the best fit and Z (row * k, param)."""
        parts, n, k = self.B.shape[:3]
        BZ = (self.B @ Z.reshape(n, k, -1)).reshape(parts, n * k, -1)
        cross = np.stack([np.einsum("mp,cmp->c", one, BZ) for one in BZ])
        return _Terms(
            Z.T @ BZ,
            np.einsum("cnij,nj->cni", self.B, e.reshape(n, k)).reshape(parts, -1),
            np.einsum("cnii->c", self.B),
            np.einsum("cnij,dnij->cd", self.B, self.B) - 2.0 * cross,
        )


def _factor(rows: Sequence[Floats], prior_information: Floats) -> Floats:
    """(param, param) lower triangle whose square is the normal matrix of the rows (row, param) and priors.

    Cholesky's, and by QR where it loses digits: seats and bars in the micrometre square the condition beyond rounding.
    """
    normal = np.diag(prior_information) + sum(Y.T @ Y for Y in rows)
    size = np.sqrt(np.diag(normal))
    try:
        lower = np.asarray(np.linalg.cholesky(normal), dtype=np.float64)
        if np.all(np.diag(lower) >= LOST * size):
            return lower
    except np.linalg.LinAlgError:
        pass
    stacked = np.concatenate([np.diag(np.sqrt(prior_information)), *rows])
    upper = np.asarray(np.linalg.qr(stacked, mode="r"), dtype=np.float64)
    if np.any(dependent := np.abs(np.diag(upper)) <= DEPENDENT * size):
        says = "restricted likelihood: data and priors leave a combination of parameters open"
        raise UndeterminedError(says, np.flatnonzero(dependent).tolist())
    return upper.T


def score_at(
    rows: Sequence[NoisyRows | IndependentRows],
    log_variance: Floats,
    prior_information: Floats,
    prior_gradient: Floats,
) -> Score:
    """UndeterminedError where data and priors leave a combination of the parameters open.

    `prior_information` (param,) is 1/sigma^2 (0: none), `prior_gradient` (param,) that times the deviation from it.
    """
    n, p = len(log_variance), len(prior_information)
    whitened = [_whitened(each, log_variance) for each in rows]
    L = _factor([w.Y for w in whitened], prior_information)
    shift = -cho_solve((L, True), sum(w.Y.T @ w.y for w in whitened) + prior_gradient, check_finite=False)
    spread, products, answers = np.zeros((n, p, p)), np.zeros((n, n)), np.zeros((n, n))
    square = _of_one(L, prior_information) if len(whitened) == 1 else None
    squared, traces, pulls = np.zeros(n), np.zeros(n), np.zeros((n, p))
    for w in whitened:
        if not w.sources:  # as large as stated: nothing to find
            continue
        e = w.y + w.Y @ shift
        Z = _divided(w.Y, L)
        of, terms = w.sources, w.terms(e, Z, square)
        spread[of] += terms.spread
        squared[of] += terms.weighted @ e
        traces[of] += terms.traces
        products[np.ix_(of, of)] += terms.products
        answers[np.ix_(of, of)] += terms.weighted @ terms.weighted.T
        pulls[of] += terms.weighted @ Z
    gradient = 0.5 * (squared - traces + np.einsum("cii->c", spread))
    expected = 0.5 * (products + np.einsum("cij,dij->cd", spread, spread))
    observed = answers - pulls @ pulls.T - expected - np.diag(gradient)
    return Score(gradient, expected, observed, spread, L)


def _of_one(L: Floats, prior_information: Floats) -> Floats:
    """(param, param) Z'Z of a single instrument, by L L' = Y'Y + priors."""
    of_priors = _divided(np.diag(np.sqrt(prior_information)), L)
    return np.eye(len(L)) - of_priors.T @ of_priors


def _whitened(rows: NoisyRows | IndependentRows, log_variance: Floats) -> _Shares | _BlockShares:
    found = [i for i, source in enumerate(rows.sources) if source != FIXED]
    sources = [rows.sources[i] for i in found]
    factors = factors_of(rows.sources, log_variance)
    if isinstance(rows, IndependentRows):
        scaled = factors[:, None] * rows.parts
        variance = scaled.sum(axis=0)
        root = 1.0 / np.sqrt(variance)
        whole = len(found) == len(rows.sources)
        return _Shares(root * rows.misfit, root[:, None] * rows.jacobian, scaled[found] / variance, sources, whole)
    scaled = factors[:, None, None, None] * rows.parts
    W = whitener_of(scaled.sum(axis=0))
    B = W @ scaled[found] @ np.swapaxes(W, 1, 2)
    y, Y = np.einsum("nij,nj->ni", W, rows.misfit), W @ rows.jacobian
    return _BlockShares(y.reshape(-1), Y.reshape(-1, Y.shape[-1]), B, sources)


def _divided(rows: Floats, L: Floats) -> Floats:
    """(row, param) rows L'^-1, which BLAS solves four times faster than scipy's solve_triangular the transposed way."""
    trsm = blas.dtrsm  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    return trsm(1.0, L, rows, side=1, lower=1, trans_a=1)
