"""Size and form of one instrument's noise from its residuals, and the scatter that it shares with second encoders.

Two forms compete by likelihood: one covariance for all observations (an instrument's own noise, whatever its axes), and
repeatability of the joints seen through the arm plus the assumed own noise (a pose with a long lever scatters more).
Both under Student's t law with 5 degrees of freedom, by expectation-maximisation. Source: Lange, Little, Taylor, Robust
Statistical Modeling Using the t Distribution, J. Am. Stat. Assoc. 84(408), 1989, sections 2 and 3.

The shared part: a joint comes to rest off what its controller reads, by eps, drawn again at every stand. An encoder on
the link reads it as d = eps + its own noise, any other instrument through its lever as J eps + its own noise, with the
same sign. Given d, the best guess at eps is share d, with share = var eps / var d of each joint: 1 for a perfect
encoder on the link, 0 for one that sits in front of the gear. So the density of a sample is p(d) p(s | d), and s - J
share d has noise of its own:

    C = J share D W_d' W_s  between the whitened rows  is taken out by  z_s -> W (r_s - J share r_d),

D the covariance of d, W from the covariance of what is left. That is the inverse block Cholesky factor of the whole
sample. The shares are found with the fit by least squares of whitened r_s on the columns of W J r_d, each between 0 and
1. Source: conditional normal law, Anderson, An Introduction to Multivariate Statistical Analysis, 3rd ed. 2003, 2.5.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from calibrate.model.chain import ObservationModel

Floats = NDArray[np.float64]
NU = 5.0  # degrees of freedom: a tenth less efficient than least squares on Gaussian data, safe against outlying rows
TURNS = 20
SETTLED = 1e-4  # of -2 log L per observation
# rows; of fewer than an arm has unknowns a fit may reach one coordinate everywhere, whose variance goes to nothing and
# whose weight hides all others: one size for all coordinates of a quantity
FEWEST_FOR_FORM = 40
FLOOR = 1e-6  # of the assumed noise: perfect data have a scale, too
ROUNDING = 1e-14  # of the largest variance: fewer rows than columns, or one bound to others, leave directions without
MEDIAN_OF_SIZES = 0.6745  # of |x|, x normal with sigma 1
LOG_RATIO = (-18.0, 18.0)  # of variance by joints over own variance, as assumed both
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Scatter:
    """Noise of one instrument's observations."""

    covariance: Floats  # (row, k, k) scale of the t law
    weights: Floats  # (row,) 1 is fully trusted
    minus_two_log_likelihood: float
    free: int  # numbers estimated


def sigma_about_zero(values: Floats, axis: int | None = None) -> Floats:
    """One sigma of normal noise of mean zero from the median of |values|; gross errors hardly change it.

    Of all `values` (any shape), or along `axis`, in their unit. A common offset counts as noise: subtract it before.
    Source: Huber, Ronchetti, Robust Statistics, 2nd ed. 2009, chapter 5 (the median absolute deviation, about zero).
    """
    return np.asarray(np.median(np.abs(values), axis=axis) / MEDIAN_OF_SIZES, dtype=np.float64)


def scatter_of(
    residual: Floats, by_joint: Floats, own_sigma: Floats, quantities: Sequence[slice] = (slice(None),)
) -> Scatter:
    """Of residuals (row, k) with d reading / d joints (row, k, readings) and assumed own noise (row, k).

    `quantities`: which of the k numbers are alike, such as lengths and angles; of few rows each has one size.
    """
    if len(residual) == 0:  # all rows of the instrument are held out
        return Scatter(np.zeros((0, residual.shape[1], residual.shape[1])), np.zeros(0), 0.0, 0)
    one = _of_one_form(residual, own_sigma, quantities)
    other = _through_joints(residual, by_joint, own_sigma)
    cost = np.log(max(len(residual), 2))
    first = one.minus_two_log_likelihood + cost * one.free
    return one if first <= other.minus_two_log_likelihood + cost * other.free else other


def likelihood_of(residual: Floats, covariance: Floats) -> tuple[float, Floats]:
    """-2 log L under Student's t with scale (row, k, k), and the weights (row,)."""
    k = residual.shape[1]
    L = np.linalg.cholesky(covariance)
    z = np.linalg.solve(L, residual[..., None])[..., 0]
    square = np.sum(z**2, axis=1)
    log_det = 2.0 * np.sum(np.log(np.diagonal(L, axis1=1, axis2=2)), axis=1)
    constant = -2.0 * (gammaln((NU + k) / 2.0) - gammaln(NU / 2.0)) + k * np.log(NU * np.pi)
    each = constant + log_det + (NU + k) * np.log1p(square / NU)
    return float(np.sum(each)), (NU + k) / (NU + square)


def _of_one_form(residual: Floats, own_sigma: Floats, quantities: Sequence[slice]) -> Scatter:
    n, k = residual.shape
    one_size = n < FEWEST_FOR_FORM
    free = len(quantities) if one_size else k * (k + 1) // 2
    z = residual / own_sigma
    form, last = np.diag((sigma_about_zero(z, axis=0) + FLOOR) ** 2), np.inf
    for _ in range(TURNS):
        L = np.linalg.cholesky(form)
        square = np.sum(np.linalg.solve(L, z.T) ** 2, axis=0)
        value = _law(square, k) + n * 2.0 * float(np.sum(np.log(np.diag(L))))
        if last - value < SETTLED * n:
            break
        last, weights = value, (NU + k) / (NU + square)
        form = (weights[:, None] * z).T @ z / n
        form = _of_one_size(form, quantities) if one_size else form
        form += max(FLOOR**2, ROUNDING * float(np.trace(form))) * np.eye(k)
    value, weights = likelihood_of(z, np.broadcast_to(form, (n, k, k)))
    covariance = form * own_sigma[:, :, None] * own_sigma[:, None, :]
    return Scatter(covariance, weights, value + 2.0 * float(np.sum(np.log(own_sigma))), free)


def _of_one_size(form: Floats, quantities: Sequence[slice]) -> Floats:
    out = np.zeros_like(form)
    for part in quantities:
        own = np.diagonal(form)[part]
        out[part, part] = np.eye(len(own)) * np.mean(own)
    return out


def _law(square: Floats, k: int) -> float:
    """-2 log L of whitened squares (row,) of k values each, without the determinant of what whitened them."""
    constant = -2.0 * (gammaln((NU + k) / 2.0) - gammaln(NU / 2.0)) + k * np.log(NU * np.pi)
    return float(len(square) * constant + (NU + k) * np.sum(np.log1p(square / NU)))


def _through_joints(residual: Floats, by_joint: Floats, own_sigma: Floats) -> Scatter:
    """In axes in which both parts are diagonal, so that a ratio costs no decomposition."""
    n, k = residual.shape
    size = float(np.mean(own_sigma**2))
    arm = by_joint @ np.swapaxes(by_joint, 1, 2)
    arm = arm * (k * size / max(np.trace(arm, axis1=1, axis2=2).mean(), 1e-300))
    w, V = np.linalg.eigh(arm / (own_sigma[:, :, None] * own_sigma[:, None, :]))
    turned = np.einsum("nij,ni->nj", V, residual / own_sigma) ** 2

    def spread(log_ratio: float) -> tuple[Floats, float]:
        """(row, k) of the axes, and the scale that belongs to the ratio."""
        ratio = np.exp(log_ratio)
        axes = (1.0 + ratio * np.maximum(w, 0.0)) / (1.0 + ratio)
        square = (turned / axes).sum(axis=1)
        scale = max(float(np.median(square)) / k, FLOOR**2)
        for _ in range(TURNS):
            new = max(float((square * (NU + k) / (NU + square / scale)).sum()) / (n * k), FLOOR**2)
            settled, scale = abs(np.log(new / scale)) < SETTLED, new
            if settled:
                break
        return axes, scale

    def cost(log_ratio: float) -> float:
        axes, scale = spread(log_ratio)
        return _law(np.sum(turned / (scale * axes), axis=1), k) + float(np.sum(np.log(scale * axes)))

    from scipy.optimize import fminbound  # a fit of geometry alone does without, and starts sooner

    best: float = fminbound(cost, LOG_RATIO[0], LOG_RATIO[1], xtol=0.05)  # pyright: ignore[reportAssignmentType]
    scale, ratio = spread(best)[1], np.exp(best)
    own = np.zeros((n, k, k))
    own[:, range(k), range(k)] = own_sigma**2
    form = (own + ratio * arm) / (1.0 + ratio)
    value, weights = likelihood_of(residual, scale * form)
    return Scatter(scale * form, weights, value, 2)


@dataclass(frozen=True, eq=False)
class Lever:
    """How one instrument shows what the witness sees."""

    rows: Ints  # (row, pose) row of the witness; 0 where it has none
    trust: Floats  # (row, pose) of the witness there, 0 to 1; 0 where it has none
    by: Floats  # (row, k, pose, channel) derivative of the readings by what the witness reads

    def select(self, rows: Ints) -> "Lever":
        return Lever(self.rows[rows], self.trust[rows], self.by[rows])

    def seen(self, witness: Floats) -> Floats:
        """(row, k, ...) what the witness' rows (row, channel, ...) are in this instrument."""
        n, k, poses, channels = self.by.shape
        by = (self.by * self.trust[:, None, :, None]).reshape(n, k, poses * channels)
        there = witness[self.rows].reshape(n, poses * channels, -1)
        return (by @ there).reshape(n, k, *witness.shape[2:])

    def covariance(self, form: Floats, trust: Floats) -> Floats:
        """(row, k, k) of the witness' noise (channel, channel), each pose by a weight (row, pose)."""
        each = self.by * np.sqrt(trust)[:, None, :, None]
        return np.einsum("nkpc,cd,nlpd->nkl", each, form, each, optimize=True)


@dataclass(frozen=True, eq=False)
class SharedScatter:
    """What instruments have in common with second encoders, the witness."""

    witness: int  # index of the instrument
    share: Floats  # (channel,) of the variance of the difference that is the link's own, 0 to 1
    levers: tuple[Lever | None, ...]  # of each instrument; None: the witness itself, or nothing in common

    def alone(self, instrument: int, part: Floats, witness: Floats, rows: Ints | None = None) -> Floats:
        """Rows (row, k, ...) of one instrument less what the witness' rows (row, channel, ...) know of them.

        `part` holds these `rows` of the instrument, all if None.
        """
        lever = self.levers[instrument]
        if lever is None:
            return part
        lever = lever if rows is None else lever.select(rows)
        return part - lever.seen(witness * self.share.reshape(-1, *(1,) * (witness.ndim - 2)))

    def apart(self, parts: Sequence[Floats]) -> list[Floats]:
        """The same for the rows of all instruments; those of the witness stay."""
        return [self.alone(i, part, parts[self.witness]) for i, part in enumerate(parts)]

    def unseen(self, instrument: int, form: Floats) -> Floats | None:
        """(row, k, k) what rows scatter more whose witness is missing or not trusted; None: there are none.

        `form` (channel, channel): covariance of the witness.
        """
        lever = self.levers[instrument]
        if lever is None or np.all(lever.trust == 1.0):
            return None
        return lever.covariance(np.outer(self.share, self.share) * form, 1.0 - lever.trust)

    def whole(self, instrument: int, form: Floats) -> Floats | None:
        """(row, k, k) what rows scatter more for one who does not know the witness."""
        lever = self.levers[instrument]
        return None if lever is None else lever.covariance(np.outer(self.share, self.share) * form, lever.trust)

    def select(self, rows: Sequence[Ints]) -> "SharedScatter":
        """Some of the rows of every instrument; those of the witness are all kept."""
        each = zip(self.levers, rows, strict=True)
        return replace(self, levers=tuple(None if lever is None else lever.select(r) for lever, r in each))


def witness_of(chains: Sequence[ObservationModel]) -> int | None:
    """Index of the instrument that second encoders are."""
    return next((i for i, chain in enumerate(chains) if chain.sensor.joints_compared()), None)


def levers_of(
    chains: Sequence[ObservationModel],
    samples: Sequence[Ints],
    by_joint: Sequence[Floats],
    trust: Floats | None = None,
) -> tuple[Lever | None, ...]:
    """Of every instrument, from its rows' samples (row, pose) and derivatives by the readings (row, k, pose * joint).

    `trust` (row,) of the witness, 1 if None. None for all without a witness.
    """
    witness = witness_of(chains)
    if witness is None:
        return (None,) * len(chains)
    channels = np.array(chains[witness].sensor.joints_compared(), dtype=np.intp) - 1
    last = max(int(s.max(initial=0)) for s in samples)
    row_of = np.full(last + 1, -1, dtype=np.intp)
    row_of[samples[witness][:, 0]] = np.arange(len(samples[witness]))
    trusted = np.ones(len(samples[witness])) if trust is None else trust
    out: list[Lever | None] = []
    for i, (sample, by) in enumerate(zip(samples, by_joint, strict=True)):
        rows = row_of[sample]
        if i == witness or len(trusted) == 0 or np.all(rows < 0):
            out.append(None)
            continue
        n, poses = sample.shape
        each = by.reshape(n, by.shape[1], poses, by.shape[2] // poses)[..., channels]
        there = np.maximum(rows, 0)
        out.append(Lever(there, np.where(rows < 0, 0.0, trusted[there]), each))
    return tuple(out)


def shares_found(
    misfits: Sequence[Floats],
    levers: Sequence[Lever | None],
    whiteners: Sequence[Floats],
    active: Sequence[Ints],
    witness: int,
) -> tuple[Floats, Floats]:
    """Shares (channel,) and their sigmas: least squares of whitened misfits (row, k) on what the witness' own let
    expect, within 0 and 1. A share that nothing shows is 0 with sigma 0.

    `whiteners` (active row, k, k) of each instrument's `active` rows.
    """
    seen = misfits[witness]
    each = np.einsum("nc,cd->ncd", seen, np.eye(seen.shape[1]))  # one joint at a time
    columns, values = [np.zeros((0, seen.shape[1]))], [np.zeros(0)]
    for misfit, lever, W, rows in zip(misfits, levers, whiteners, active, strict=True):
        if lever is not None:
            columns.append((W @ lever.seen(each)[rows]).reshape(-1, seen.shape[1]))
            values.append(np.einsum("nij,nj->ni", W, misfit[rows]).ravel())
    X, y = np.concatenate(columns), np.concatenate(values)
    shown = np.any(X != 0.0, axis=0)
    out, sigma = np.zeros(len(shown)), np.zeros(len(shown))
    if shown.any():
        from scipy.optimize import lsq_linear  # only where there are second encoders: identify starts sooner

        out[shown] = lsq_linear(X[:, shown], y, (0.0, 1.0), method="bvls").x
        sigma[shown] = np.sqrt(np.diag(np.linalg.pinv(X[:, shown].T @ X[:, shown])))
    return out, sigma
