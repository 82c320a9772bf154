"""Sensitivity of the probe's error to its sources: linear propagation, each source alone, and Sobol indices.

Linear: e = sum of by_column x columns, columns independent; mean and covariance pose by pose. Source: law of
propagation, JCGM 100:2008, ch. 5.1.2.

Alone: every source takes values between plus and minus three of its sizes, all others none; the error comes from the
arm itself, not from a derivative. A phased source (eccentricity, runout) is taken over all its phases. Source: the
study of Huang Kui et al., over the whole workspace.

Sobol: first-order and total indices, a source's share of the variance alone, and with all it interacts with. The
probe's error is a vector: squares of its components are added up before shares are taken. Sources: Saltelli et al.,
Comput. Phys. Commun. 181, 2010 (both estimators, by scipy.stats.sobol_indices); Gamboa, Janon, Klein, Lagnoux,
Electron. J. Stat. 8, 2014, section 3 (vector outputs). Points are scrambled Sobol sequences; repeating them with other
scrambles gives the error bar (Owen, J. Complexity 14, 1998).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc, sobol_indices

from calibrate.error_simulation.machine import (
    ArmAtPoses,
    Columns,
    Machine,
    arm_at,
    columns_of,
    probe_errors,
)
from calibrate.error_simulation.sources import ErrorSource

Floats = NDArray[np.float64]
ROUNDING_M = 1e-15  # of a probe some metres away: what moves it by less moves it not at all


@dataclass(frozen=True)
class Linear:
    """Of the probe's error in the base, by source."""

    mean_m: Floats  # (source, pose, 3)
    covariance_m2: Floats  # (source, pose, 3, 3)

    @property
    def rms_m(self) -> Floats:
        """(pose,) three axes together, all sources."""
        spread = np.trace(self.covariance_m2.sum(axis=0), axis1=-2, axis2=-1)
        return np.sqrt(np.sum(self.mean_m.sum(axis=0) ** 2, axis=-1) + spread)

    @property
    def sigma_m(self) -> Floats:
        """(pose, 3) by axis, about the mean."""
        return np.sqrt(np.diagonal(self.covariance_m2.sum(axis=0), axis1=-2, axis2=-1))

    @property
    def bias_m(self) -> Floats:
        """(pose, 3)."""
        return self.mean_m.sum(axis=0)

    @property
    def alone_m(self) -> Floats:
        """(source,) rms over the poses of each source alone, three axes together."""
        spread = np.trace(self.covariance_m2, axis1=-2, axis2=-1)
        return np.sqrt(np.mean(np.sum(self.mean_m**2, axis=-1) + spread, axis=1))

    @property
    def shares(self) -> Floats:
        """(source,) of the variance over all poses: the first-order indices, were the arm linear."""
        variance = np.trace(self.covariance_m2, axis1=-2, axis2=-1).mean(axis=1)
        return variance / max(float(variance.sum()), 1e-300)


def propagate(machine: Machine, sources: Sequence[ErrorSource], q_rad: Floats) -> Linear:
    """At readings (pose, joint)."""
    by_slot = machine.by_slot(q_rad)
    mean, covariance = np.zeros((len(sources), len(q_rad), 3)), np.zeros((len(sources), len(q_rad), 3, 3))
    for i, source in enumerate(sources):
        by, (first, second) = source.by_column(by_slot, q_rad), source.moments
        mean[i] = by @ first
        covariance[i] = (by * second) @ np.swapaxes(by, 1, 2)
    return Linear(mean, covariance)


STEPS = 25  # values, an odd number: zero is one of them
SPAN = 3.0  # sizes to both sides
PHASES = 16


@dataclass(frozen=True)
class Single:
    """One source alone."""

    name: str
    group: str
    unit: str
    value: Floats  # (step,) in its unit
    rms_m: Floats  # (step,) error of the probe over the poses
    max_m: Floats  # (step,) at the worst of them
    gain: float  # rms error of the probe by a unit of the source, at no error: m/m, m/rad, m/K


def alone(machine: Machine, source: ErrorSource, q_rad: Floats) -> Single:
    """Over readings (pose, joint)."""
    columns = columns_of([source])
    arm = arm_at(machine, [source], columns, q_rad)
    size = np.sqrt(source.law.square)
    value = np.linspace(-SPAN * size, SPAN * size, STEPS)
    own, other = columns.of_source[0].tolist()
    turns = np.arange(PHASES) * (2.0 * np.pi / PHASES) if other >= 0 else np.zeros(1)
    X = np.zeros((STEPS, len(turns), columns.count))
    X[..., own] = value[:, None] * np.cos(turns)
    if other >= 0:
        X[..., other] = value[:, None] * np.sin(turns)
    nominal, square = arm.nominal_m(), np.zeros((len(q_rad), STEPS, len(turns)))
    for pose in range(len(q_rad)):
        errors = probe_errors(arm, pose, X.reshape(-1, columns.count), nominal[pose])
        square[pose] = np.sum(errors**2, axis=1).reshape(STEPS, -1)
    rms, largest = np.sqrt(square.mean(axis=(0, 2))), np.sqrt(square.max(axis=(0, 2)))
    by = source.by_column(machine.by_slot(q_rad), q_rad)
    gain = float(np.sqrt(np.mean(np.sum(by**2, axis=(1, 2)) / by.shape[2])))
    return Single(source.name, source.group, source.unit, value, rms, largest, gain)


def each_alone(machine: Machine, sources: Sequence[ErrorSource], q_rad: Floats) -> tuple[Single, ...]:
    """In the order of the sources."""
    return tuple(alone(machine, source, q_rad) for source in sources)


POINTS = 1024  # a power of two, as the sequence wants
SCRAMBLES = 8
OPEN = 2.0**-40  # shares are kept off 0 and 1, where a quantile is infinite


@dataclass(frozen=True)
class SobolIndices:
    """One each source; sigma is that of the mean over the scrambles. All zero where nothing moves the probe."""

    poses: int  # that they were worked out over, all together
    first: Floats
    first_sigma: Floats
    total: Floats
    total_sigma: Floats


def indices_of(
    machine: Machine,
    sources: Sequence[ErrorSource],
    q_rad: Floats,
    *,
    seed: int,
    points: int = POINTS,
    scrambles: int = SCRAMBLES,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SobolIndices:
    """Over all poses (pose, joint) together."""
    columns = columns_of(sources)
    arm = arm_at(machine, sources, columns, q_rad)
    nominal = arm.nominal_m()
    each: list[tuple[Floats, Floats]] = []
    for k, rng in enumerate(np.random.default_rng(seed).spawn(scrambles)):
        each.append(_once(sources, columns, arm, nominal, points, rng))
        progress(k + 1, scrambles)
    first, total = (np.stack(values) for values in zip(*each, strict=True))
    spread = np.sqrt(max(scrambles - 1, 1) * scrambles)
    return SobolIndices(
        len(q_rad),
        first.mean(axis=0),
        np.sqrt(np.sum((first - first.mean(axis=0)) ** 2, axis=0)) / spread,
        total.mean(axis=0),
        np.sqrt(np.sum((total - total.mean(axis=0)) ** 2, axis=0)) / spread,
    )


def _once(
    sources: Sequence[ErrorSource],
    columns: Columns,
    arm: ArmAtPoses,
    nominal_m: Floats,
    points: int,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    shares = np.clip(qmc.Sobol(2 * columns.count, rng=rng).random(points), OPEN, 1.0 - OPEN)
    A, B = (_values(sources, columns, part) for part in np.split(shares, 2, axis=1))

    def errors(X: Floats) -> Floats:
        """(3 pose, point)."""
        return np.concatenate([probe_errors(arm, pose, X, nominal_m[pose]).T for pose in range(len(nominal_m))])

    f_A, f_B = errors(A), errors(B)
    f_AB = np.empty((len(sources), *f_A.shape))
    for i, own in enumerate(columns.of_source):
        mixed, mine = A.copy(), own[own >= 0]
        mixed[:, mine] = B[:, mine]
        f_AB[i] = errors(mixed)
    moving = np.ptp(f_A, axis=1) > ROUNDING_M  # a component that nothing moves has no shares
    if not moving.any():
        return np.zeros(len(sources)), np.zeros(len(sources))
    found = sobol_indices(func={"f_A": f_A[moving], "f_B": f_B[moving], "f_AB": f_AB[:, moving]}, n=points)
    variance = np.var(np.concatenate([f_A[moving], f_B[moving]], axis=1), axis=1)
    weight = variance / variance.sum()
    shape = len(weight), len(sources)  # scipy drops axes of one
    return weight @ np.reshape(found.first_order, shape), weight @ np.reshape(found.total_order, shape)


def _values(sources: Sequence[ErrorSource], columns: Columns, shares: Floats) -> Floats:
    """(point, column) of shares in 0 ... 1 of every column."""
    out = np.zeros_like(shares)
    for source, (own, phase) in zip(sources, columns.of_source.tolist(), strict=True):
        value = source.law.quantiles(shares[:, own])
        out[:, own] = value
        if phase >= 0:
            turn = 2.0 * np.pi * shares[:, phase]
            out[:, own], out[:, phase] = value * np.cos(turn), value * np.sin(turn)
    return out
