"""A damped oscillation in several channels: start by the matrix pencil, then least squares.

    y_c(t) = level_c + exp(-z w t) (a_c cos(w sqrt(1 - z^2) t) + b_c sin(...))

Matrix pencil: Hua and Sarkar, IEEE ASSP 38 (1990) 814: poles are eigenvalues of the shift between the signal vectors
of a Hankel matrix; stacked channels share them. Least squares by variable projection: amplitudes are linear.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import hankel
from scipy.optimize import least_squares
from scipy.special import fdtrc

from calibrate.diagnose.streams import limits

Floats = NDArray[np.float64]

GONE = 1e-9  # of a swing within one step: that is none
POLES = 6  # one oscillation is two; the others take settling and noise
MOST = 300  # samples of the pencil, averaged to that: it is a start only
SAME = 0.05  # starts nearer than this in turn lead to the same place
SWING_SAMPLES = 8.0  # of one swing, for its decay and turn


@dataclass(frozen=True)
class Swing:
    """`amplitude` (channel,) complex, at the first sample: a - i b; sigmas from the fit's own residual."""

    frequency_hz: float  # undamped
    damping: float
    frequency_sigma_hz: float
    damping_sigma: float
    amplitude: NDArray[np.complex128]
    amplitude_sigma: Floats  # (channel,)
    squares_before: float  # of the residual in sigmas, with levels and one settling only
    squares_after: float
    numbers: int


def swing(time_s: Floats, values: Floats, noise: Floats) -> Swing | None:
    """Best oscillation of (sample, channel) values with `noise` (channel,). None where there is nothing that swings."""
    t, y = time_s - time_s[0], values / noise
    y = y - y.mean(axis=0)
    best: Swing | None = None
    before = _without(t, y)
    for pole in _starts(t, y):
        if chance(before, _left_by(t, y, pole), _numbers(y), y.size) >= 1.0:
            continue  # not worth the refining: a start is near enough to see a swing by
        one = _refined(t, y, pole, before)
        if one is not None and (best is None or one.squares_after < best.squares_after):
            best = one
    return None if best is None else _in_units(best, noise)


def chance(before: float, after: float, numbers: int, size: int) -> float:
    """Of white noise giving such a swing anywhere in the band: F test, times the frequencies that were open."""
    left = after / max(size - numbers, 1)
    gain = max(before - after, 0.0) / numbers
    return float(size * fdtrc(numbers, max(size - numbers, 1), gain / max(left, 1e-300)))


def _numbers(y: Floats) -> int:
    """Of a fit: decay and turn, and of each channel two amplitudes and a level."""
    return 2 + 3 * y.shape[1]


def _left_by(t: Floats, y: Floats, pole: tuple[float, float]) -> float:
    U, _ = np.linalg.qr(_basis(t, *pole))
    return float(np.sum(y**2) - np.sum((U.T @ y) ** 2))


def _thinned(t: Floats, y: Floats, turn: float) -> tuple[Floats, Floats]:
    """Means of neighbours, still SWING_SAMPLES a swing: decay and turn of a swing are the same in them."""
    every = int(2.0 * np.pi / turn / SWING_SAMPLES / float(np.median(np.diff(t))))
    if every < 2:
        return t, y
    whole = len(t) // every * every
    return t[:whole].reshape(-1, every).mean(axis=1), y[:whole].reshape(-1, every, y.shape[1]).mean(axis=1)


def _starts(t: Floats, y: Floats) -> list[tuple[float, float]]:
    """(decay 1/s, turn rad/s) of candidates, from the pencil."""
    every = max(1, len(t) // MOST)
    whole = len(t) // every * every
    t = t[:whole].reshape(-1, every).mean(axis=1)
    y = y[:whole].reshape(-1, every, y.shape[1]).mean(axis=1)
    step_s = float(np.median(np.diff(t)))
    length = len(t) // 3
    if length < 2 * POLES:
        return []
    rows = np.vstack([hankel(c[: len(t) - length], c[len(t) - length - 1 :]) for c in y.T])
    strongest = np.linalg.eigh(rows.T @ rows)[1][:, ::-1]  # right singular vectors, good enough for a start
    out: list[tuple[float, float]] = []
    for order in (3, POLES):
        V = strongest[:, :order]
        turns = np.linalg.eigvals(np.linalg.lstsq(V[:-1], V[1:], rcond=None)[0]).astype(complex)
        poles = np.log(turns[np.abs(turns) > GONE]) / step_s
        out += [(-float(p.real), float(p.imag)) for p in poles if p.imag > 0.0]
    slowest, fastest = 2.0 * np.pi * limits.FEWEST_CYCLES / (t[-1] - t[0]), 2.0 * np.pi / (limits.FINEST_SWING * step_s)
    good = [(max(decay, 0.01 * turn), turn) for decay, turn in out if slowest < turn < fastest and decay < turn]
    return [one for i, one in enumerate(good) if all(abs(one[1] / other[1] - 1.0) > SAME for other in good[:i])]


def _basis(t: Floats, decay: float, turn: float) -> Floats:
    fade = np.exp(-np.clip(decay * t, -50.0, 700.0))  # a step of the solver may try growth
    return np.stack([fade * np.cos(turn * t), fade * np.sin(turn * t), np.ones_like(t)], axis=1)


def _refined(t: Floats, y: Floats, pole: tuple[float, float], before: float) -> Swing | None:
    """Decay and turn by least squares, amplitudes projected out (Golub and Pereyra 1973)."""
    few_t, few_y = _thinned(t, y, pole[1])

    def left(p: Floats) -> Floats:
        U, _ = np.linalg.qr(_basis(few_t, p[0], p[1]))
        return (few_y - U @ (U.T @ few_y)).ravel()

    found = least_squares(left, np.array(pole), x_scale=np.abs(pole), method="lm", max_nfev=200)
    decay, turn = float(found.x[0]), abs(float(found.x[1]))
    undamped = float(np.hypot(decay, turn))
    cycles = turn * t[-1] / (2.0 * np.pi)
    fastest = 2.0 * np.pi / (limits.FINEST_SWING * float(np.median(np.diff(t))))
    if not (0.0 < decay < limits.MOST_DAMPING * undamped) or cycles < limits.FEWEST_CYCLES or turn > fastest:
        return None
    numbers = _numbers(y)
    normal = found.jac.T @ found.jac
    if not np.linalg.cond(normal) < 1e14:
        return None
    covariance = float(found.fun @ found.fun) / max(len(found.fun) - numbers, 1) * np.linalg.inv(normal)
    f_by = np.array([decay, turn]) / undamped
    z_by = np.array([turn**2, -decay * turn]) / undamped**3
    B = _basis(t, decay, turn)
    coefficients = np.linalg.lstsq(B, y, rcond=None)[0]
    after = _left_by(t, y, (decay, turn))
    spread = np.sqrt(after / max(y.size - numbers, 1) * np.diag(np.linalg.inv(B.T @ B))[:2].max())
    return Swing(
        undamped / (2.0 * np.pi),
        decay / undamped,
        float(np.sqrt(f_by @ covariance @ f_by)) / (2.0 * np.pi),
        float(np.sqrt(z_by @ covariance @ z_by)),
        coefficients[0] - 1j * coefficients[1],
        np.full(y.shape[1], spread),
        before,
        after,
        numbers,
    )


def _without(t: Floats, y: Floats) -> float:
    """Squares that a level and one exponential settling leave: what does not swing must not look as if it did."""
    best = np.inf
    for decay in 1.0 / np.geomspace(t[1] if t[1] > 0.0 else 1e-3, t[-1], 12):
        B = np.stack([np.ones_like(t), np.exp(-decay * t)], axis=1)
        U, _ = np.linalg.qr(B)
        rest = y - U @ (U.T @ y)
        best = min(best, float(np.sum(rest**2)))
    return best


def _in_units(one: Swing, noise: Floats) -> Swing:
    return Swing(
        one.frequency_hz,
        one.damping,
        one.frequency_sigma_hz,
        one.damping_sigma,
        one.amplitude * noise,
        one.amplitude_sigma * noise,
        one.squares_before,
        one.squares_after,
        one.numbers,
    )
