"""What may be innocent in a residual: its size, its channels, and whether it wanders along the session.

Residuals of a fit are smaller than the noise, the more so the more slowly it wanders, since geometry absorbs it; so the
spectrum that a wander would leave behind geometry is drawn, and compared with the one seen.

Noise that wanders slowly: white noise plus a first-order autoregression, along the order of capture.
Source: Brockwell, Davis, Time Series: Theory and Methods, 1991, sections 3.1 and 4.4.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.fft import dct

from calibrate.diagnose.search import limits
from calibrate.diagnose.state.linearised import WhitenedRows
from calibrate.diagnose.state.visible import Sight
from calibrate.fit.noise import NU

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

PROBES = 24  # draws for the spectrum that geometry leaves of a wander

# Correlation from one sample to the next; the last one is a random walk over any session.
RHO = np.array([0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.995])
# Share of the variance that wanders.
SHARE = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 0.95, 0.99])


@dataclass(frozen=True)
class Wander:
    """Share of the variance that wanders, and its correlation from one sample to the next."""

    share: float
    rho: float

    def draw(self, shape: tuple[int, ...], rng: Generator) -> Floats:
        """Stationary noise of unit variance, along the first axis."""
        white: Floats = rng.standard_normal(shape)
        if self.share == 0.0:
            return white
        slow: Floats = rng.standard_normal(shape)
        slow[1:] *= np.sqrt(1.0 - self.rho**2)
        for before, now in pairwise(slow):
            now += self.rho * before
        white *= np.sqrt(1.0 - self.share)  # in place: draws are large
        slow *= np.sqrt(self.share)
        white += slow
        return white


@dataclass(frozen=True)
class Series:
    """Rows of one instrument in the order of capture, and what a wander would resemble in its residual."""

    rows: Ints  # (time, k) row numbers
    forms: tuple[Wander, ...]
    spectra: Floats  # (form, time) of unit-variance noise behind geometry, mean over the channels
    wander: Wander  # the one that the residual shows

    def each(self, residual: Floats) -> Floats:
        """(draw, form) -2 log L of residuals (row, draw); each channel has its own variance."""
        n, k = self.rows.shape
        power = _power(residual[self.rows]).reshape(n, -1)
        log_variance = np.log(np.maximum((1.0 / self.spectra) @ power / n, 1e-300)).reshape(len(self.forms), k, -1)
        return k * np.sum(np.log(self.spectra), axis=1) + n * np.sum(log_variance, axis=1).T

    def minus_two_log_likelihood(self, residual: Floats) -> Floats:
        """(draw,) the smallest over all forms, of residuals (row, draw)."""
        return np.min(self.each(residual), axis=1)


@dataclass(frozen=True)
class NoiseLaw:
    """How to draw noise like that of the session."""

    rows: WhitenedRows
    inflated: Floats  # (row,) residual, leverage corrected
    series: tuple[Series, ...]

    @property
    def wanders(self) -> bool:
        """Whether any instrument's noise does."""
        return any(s.wander.share > 0.0 for s in self.series)

    @cached_property
    def curvature(self) -> float:
        """See `curvature_of`."""
        return curvature_of(self.rows)

    def gain(self, before: Floats, after: Floats) -> Floats:
        """(draw,) -2 log L from residuals (row, draw) to others, each with the wander that fits it best."""
        each = (s.minus_two_log_likelihood(before) - s.minus_two_log_likelihood(after) for s in self.series)
        return np.sum(list(each), axis=0)

    def draw(self, rng: Generator, count: int) -> Floats:
        """(row, count): residuals of whole samples with signs and lengths drawn again where noise is white, Gaussian
        wander where not.

        All instruments of a sample flip together, since the repeatability of the joints may be in each of them. Lengths
        are drawn, too, since those that happened to be found are one draw themselves. With the lengths kept, the first
        p of 160 drawn quiet sessions (48 shots, second encoders on the links) was below 1.5 % in 1.9 % of them for fast
        terms and in 4.4 % for slow ones; with lengths drawn, and noise of each instrument by its own degrees of
        freedom, in 1.3 % and 1.3 %.
        """
        _, groups = np.unique(self.rows.sample, return_inverse=True)
        alone = np.where(self.rows.data, groups, groups.max(initial=0) + 1 + np.arange(len(groups)))
        signs = rng.integers(0, 2, (int(alone.max(initial=0)) + 1, count)).astype(np.float64) * 2.0 - 1.0
        out = signs[alone]
        out *= self.inflated[:, None]
        out *= self._stretched(rng, count)
        for s in self.series:
            if s.wander.share > 0.0:
                n, k = s.rows.shape
                found = self.inflated[s.rows]
                L = np.linalg.cholesky(found.T @ found / n + 1e-12 * np.eye(k))
                drawn = s.wander.draw((n, k, count), rng)
                out[s.rows] = np.einsum("ij,tjd->tid", L, drawn)
        return out

    def _stretched(self, rng: Generator, count: int) -> Floats:
        """(row, count) by which each observation's residual is drawn longer or shorter; 1 for what is no data."""
        data = np.flatnonzero(self.rows.data)
        _, first, group = np.unique(self.rows.group[data], return_index=True, return_inverse=True)
        square = np.bincount(group, self.inflated[data] ** 2).astype(np.float64)
        instrument = self.rows.instrument[data[first]]
        factor = np.ones((len(square), count))
        for one in np.unique(instrument):
            mine = np.flatnonzero((instrument == one) & (square > 0.0))
            if len(mine) >= limits.FEWEST_FOR_LENGTHS:
                factor[mine] = np.sqrt(_lengths(square[mine], (len(mine), count), rng) / square[mine, None])
        out = np.ones((len(self.rows.data), count))
        out[data] = factor[group]
        return out


def _lengths(square: Floats, shape: tuple[int, ...], rng: Generator) -> Floats:
    """Squares drawn from the gamma law with mean and variance of those found (group,): chi-square for Gaussian noise,
    whatever the scale, and longer or shorter in the tail as they are.
    """
    mean, variance = float(np.mean(square)), float(np.var(square))
    if mean <= 0.0 or variance <= 0.0:
        return np.full(shape, mean)
    return rng.gamma(mean**2 / variance, variance / mean, shape)


def curvature_of(rows: WhitenedRows) -> float:
    """Of the log likelihood over that of reweighted least squares at the same weights, below one for a t law.

    A step of the fit is longer than the least-squares step by its inverse. Hessian of the t law: Lange, Little, Taylor,
    J. Am. Stat. Assoc. 84(408), 1989, appendix B.
    """
    _, group, k = np.unique(rows.group[rows.data], return_inverse=True, return_counts=True)
    square = np.bincount(group, rows.residual[rows.data] ** 2)
    # Whitened squares hold the weight: R = w s with w = (nu + k) / (nu + s), hence w = (nu + k - R) / nu.
    square = np.minimum(square, NU + k)
    weight = (NU + k - square) / NU
    return float(np.sum(weight * k * (1.0 - 2.0 * square / (k * (NU + k)))) / np.sum(weight * k))


def noise_law(rows: WhitenedRows, sight: Sight, t_s: Floats, rng: Generator) -> NoiseLaw:
    """Of a state's rows; `t_s` (sample,) gives the order of capture."""
    leverage = np.minimum(np.sum(sight.basis**2, axis=1), limits.MOST_LEVERAGE)
    inflated = sight.residual / np.sqrt(1.0 - np.where(rows.data, leverage, 0.0))
    found = [_series(rows, sight, t_s, at, rng) for at in capture_orders(rows, t_s)]
    return NoiseLaw(rows, inflated, tuple(found))


def capture_orders(rows: WhitenedRows, t_s: Floats) -> Sequence[Ints]:
    """(time, k) row numbers of every instrument with enough observations."""
    out: list[Ints] = []
    for instrument in np.unique(rows.instrument[rows.data]):
        mine = np.flatnonzero(rows.data & (rows.instrument == instrument))
        k = int(np.sum(rows.group[mine] == rows.group[mine[0]]))
        by_group = mine.reshape(-1, k)
        if len(by_group) >= limits.FEWEST_FOR_WANDER:
            out.append(by_group[np.argsort(t_s[rows.sample[by_group[:, 0]]], kind="stable")])
    return out


def _series(rows: WhitenedRows, sight: Sight, t_s: Floats, at: Ints, rng: Generator) -> Series:
    n, k = at.shape
    shape = (n, k, PROBES)
    levels = [_left(sight, at, rng.standard_normal(shape))]
    levels += [_left(sight, at, Wander(1.0, float(rho)).draw(shape, rng)) for rho in RHO]
    forms, spectra = [Wander(0.0, float(RHO[0]))], [levels[0]]
    for rho, level in zip(RHO, levels[1:], strict=True):
        for share in SHARE[1:]:
            forms.append(Wander(float(share), float(rho)))
            spectra.append((1.0 - share) * levels[0] + share * level)
    blank = Series(at, tuple(forms), np.stack(spectra), forms[0])
    return Series(at, blank.forms, blank.spectra, _strongest(blank, sight.residual))


def _left(sight: Sight, at: Ints, drawn: Floats) -> Floats:
    """(time,) mean power that geometry leaves of noise (time, k, draw), smoothed over neighbouring frequencies."""
    whole = np.zeros((len(sight.residual), drawn.shape[2]))
    whole[at] = drawn
    whole -= sight.basis @ (sight.basis.T @ whole)
    power = np.mean(_power(whole[at]), axis=(1, 2))
    padded = np.pad(power, 1, mode="edge")
    return np.maximum((padded[:-2] + padded[1:-1] + padded[2:]) / 3.0, 1e-3)


def _strongest(series: Series, residual: Floats) -> Wander:
    values = series.each(residual[:, None])[0]
    if values[0] - np.min(values) < limits.WANDERS:
        return series.forms[0]
    near = np.flatnonzero(values <= np.min(values) + limits.WANDER_CONSERVATIVE)
    slow = [series.forms[i].share / (1.0 - series.forms[i].rho) for i in near]
    return series.forms[near[int(np.argmax(slow))]]


def _power(series: Floats) -> Floats:
    """Squares of the orthonormal cosine coefficients along the first axis."""
    return np.square(np.asarray(dct(series, axis=0, norm="ortho")))
