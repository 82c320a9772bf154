"""Scatter that is innocent: an instrument's own, and the repeatability of the joints seen through the arm.

Joints that come back to a pose by chance a little off scatter more where the arm's lever is long; no driver is missing
for that (repeatability, ISO 9283, section 7.2). A clock that runs late scatters all joints likewise, but only where the
arm moves: two kinds of samples, against one kind with heavy tails (Student's t law, Lange, Little, Taylor, J. Am. Stat.
Assoc. 84(408), 1989; mixture of two, Dempster, Laird, Rubin, J. Royal Stat. Soc. B 39(1), 1977).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from calibrate.diagnose.assess import limits
from calibrate.fit.noise import NU

Floats = NDArray[np.float64]

LOUDNESS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0, 1e4)  # variance through joints over noise's, mean trace
SHARES = (0.15, 0.3, 0.5, 0.7, 0.85)  # of samples that scatter through the joints
TURNS = 12
HEAVY = (2.5, NU)  # degrees of freedom of innocent tails
SWEEPS = 6  # over the joints
BLOCK = 3  # channels of one unit: a position, a rotation; two detectors have one unit, too


@dataclass(frozen=True, eq=False)
class Innocent:
    """The covariance of an instrument's observations without any driver."""

    whitener: Floats  # (observation, k, k)
    two_log_likelihood: float
    through_joints: bool
    restless: float  # 2 ln L by which some samples scatter through the joints and the others do not; 0 where none do
    share: float = 0.0  # of the variance that comes through the joints


def innocent(raw: Floats, joints: Floats) -> Innocent:
    """Of residuals (observation, k) in the instrument's unit and how they follow each joint (joint, observation, k)."""
    trials = [trial for form in _forms(raw) for trial in _trials(raw, joints, form)]
    best = max(trials, key=lambda trial: trial.two_log_likelihood)
    if best.loud > 0.0:
        best = _unequal(raw, joints, best)
    y, w, V = best.seen(raw, joints)
    width = 1.0 + best.loud * w
    root = np.einsum("okm,om,ojm->okj", V, 1.0 / np.sqrt(width), V) @ best.by / np.sqrt(best.scale)
    restless = _restless(np.einsum("okm,ok->om", V, y) ** 2, w) if best.loud > 0.0 else 0.0
    return Innocent(root, best.two_log_likelihood, best.loud > 0.0, restless, best.loud / (1.0 + best.loud))


@dataclass(frozen=True, eq=False)
class _Trial:
    """One guess at the innocent scatter."""

    by: Floats  # (k, k) whitens the instrument's own noise
    sizes: Floats  # (joint,) how far each joint comes back off, relative
    loud: float
    scale: float
    two_log_likelihood: float

    def seen(self, raw: Floats, joints: Floats) -> tuple[Floats, Floats, Floats]:
        """Residuals (observation, k) and the spectrum of the joints behind `by`."""
        return raw @ self.by.T, *spectrum((self.sizes[:, None, None] * joints) @ self.by.T)


def _trials(raw: Floats, joints: Floats, form: Floats) -> list[_Trial]:
    """One of each loudness: what all of them see is the same."""
    by = np.asarray(np.linalg.inv(np.linalg.cholesky(form)), dtype=np.float64)
    plain = _Trial(by, np.ones(len(joints)), 0.0, 1.0, -np.inf)
    seen = plain.seen(raw, joints)
    return [_judged(seen, replace(plain, loud=loud)) for loud in (0.0, *LOUDNESS)]


def _judged(seen: tuple[Floats, Floats, Floats], trial: _Trial) -> _Trial:
    y, w, V = seen
    turned, width = np.einsum("okm,ok->om", V, y) ** 2, 1.0 + trial.loud * w
    scale = float(np.mean(turned / width))
    value = 2.0 * len(y) * _log_det(trial.by) - float(np.sum(np.log(width))) - y.size * (np.log(scale) + 1.0)
    return replace(trial, scale=scale, two_log_likelihood=value)


def _unequal(raw: Floats, joints: Floats, best: _Trial) -> _Trial:
    """Joints one after the other a step better or worse than the rest, as long as that explains more."""
    steps = np.zeros(len(joints), dtype=np.intp)
    for _ in range(SWEEPS):
        last = best
        for joint in range(len(joints)):
            for step in (-1, 1):
                moved = steps.copy()
                moved[joint] += step
                if np.ptp(moved) > limits.UNEQUAL_STEPS:
                    continue
                unequal = replace(best, sizes=limits.UNEQUAL_JOINTS ** (moved / limits.UNEQUAL_STEPS))
                trial = _judged_by_form(raw, joints, unequal)
                if trial.two_log_likelihood > best.two_log_likelihood:
                    best, steps = trial, moved
        if best is last:
            break
    return best


def _judged_by_form(raw: Floats, joints: Floats, trial: _Trial) -> _Trial:
    """`_judged` at one loudness: without eigenvectors in a fifth of the time."""
    y = raw @ trial.by.T
    form = np.eye(y.shape[1]) + trial.loud * _form((trial.sizes[:, None, None] * joints) @ trial.by.T)
    scale = float(np.mean(y * np.linalg.solve(form, y[:, :, None])[:, :, 0]))
    width = float(np.sum(np.log(np.linalg.det(form))))
    value = 2.0 * len(y) * _log_det(trial.by) - width - y.size * (np.log(scale) + 1.0)
    return replace(trial, scale=scale, two_log_likelihood=value)


def spectrum(felt: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues (observation, k), mean trace k, and vectors of the scatter by levers (lever, observation, k)."""
    w, V = np.linalg.eigh(_form(felt))
    return np.maximum(w, 0.0), V


def _form(felt: Floats) -> Floats:
    """(observation, k, k) scatter by levers (lever, observation, k), of mean trace k."""
    levers = felt.transpose(1, 2, 0)
    form = levers @ np.swapaxes(levers, 1, 2)
    size = float(np.mean(np.trace(form, axis1=1, axis2=2))) / felt.shape[2]
    return np.asarray(form / max(size, 1e-300))


def _forms(raw: Floats) -> list[Floats]:
    """Own noise as the residuals have it, and alike in all channels of one unit."""
    found = raw.T @ raw / len(raw)
    own, k = np.diag(found).copy(), raw.shape[1]
    blocks = [slice(0, BLOCK), slice(BLOCK, k)] if k == 2 * BLOCK else [slice(0, k)]
    for block in blocks:
        own[block] = own[block].mean()
    return [found + 1e-9 * np.diag(own), np.diag(own)]


def _restless(turned: Floats, w: Floats) -> float:
    """2 ln L of two kinds of samples over that of one kind, be it Gaussian or of heavy tails."""
    one = max(
        max(_gaussian(turned, 1.0 + loud * w), *(_student(turned, 1.0 + loud * w, nu) for nu in HEAVY))
        for loud in (0.0, *LOUDNESS)
    )
    two = max(_mixed(turned, w, loud, share) for loud in LOUDNESS for share in SHARES)
    return max(0.0, 2.0 * (two - one))


def _gaussian(turned: Floats, width: Floats) -> float:
    scale = float(np.mean(turned / width))
    return float(np.sum(_log_normal(turned, scale * width)))


def _student(turned: Floats, width: Floats, nu: float) -> float:
    k = turned.shape[1]
    square, scale = np.sum(turned / width, axis=1), float(np.mean(turned / width))
    for _ in range(TURNS):
        scale = float(np.mean((nu + k) / (nu + square / scale) * square)) / k
    constant = gammaln((nu + k) / 2.0) - gammaln(nu / 2.0) - 0.5 * k * np.log(nu * np.pi * scale)
    each = constant - 0.5 * np.sum(np.log(width), axis=1) - 0.5 * (nu + k) * np.log1p(square / scale / nu)
    return float(np.sum(each))


def _mixed(turned: Floats, w: Floats, loud: float, share: float) -> float:
    """Some samples as the instrument alone, `share` of them through the joints, too."""
    scale = float(np.median(turned)) / 0.4549 if share < 0.5 else float(np.mean(turned / (1.0 + loud * w)))
    widths = np.stack([np.ones_like(w), 1.0 + loud * w])
    squares, logs = np.sum(turned / widths, axis=2), np.sum(np.log(2.0 * np.pi * widths), axis=2)
    priors = np.log(np.array([[1.0 - share], [share]]))
    value = -np.inf
    for _ in range(TURNS):
        each = priors - 0.5 * (turned.shape[1] * np.log(scale) + logs + squares / scale)
        total = np.logaddexp(each[0], each[1])
        value = float(np.sum(total))
        scale = float(np.sum(np.exp(each - total) * squares)) / turned.size
    return value


def _log_normal(turned: Floats, variance: Floats) -> Floats:
    return np.asarray(-0.5 * np.sum(np.log(2.0 * np.pi * variance) + turned / variance, axis=1))


def _log_det(A: Floats) -> float:
    return float(np.sum(np.log(np.diag(A))))
