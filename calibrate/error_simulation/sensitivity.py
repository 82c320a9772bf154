"""First-order and total indices of every source: its share of the variance alone, and with all it interacts with.

The probe's error is a vector: squares of its components are added up before shares are taken. Sources: Saltelli et
al., Comput. Phys. Commun. 181, 2010 (both estimators, by scipy.stats.sobol_indices); Gamboa, Janon, Klein, Lagnoux,
Electron. J. Stat. 8, 2014, section 3 (vector outputs). Points are scrambled Sobol sequences; repeating them with
other scrambles gives the error bar (Owen, J. Complexity 14, 1998).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc, sobol_indices

from calibrate.error_simulation.columns import ArmAtPoses, Columns, arm_at, columns_of, probe_errors
from calibrate.error_simulation.linear import ROUNDING_M
from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.source import Source

Floats = NDArray[np.float64]

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
    sources: Sequence[Source],
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
    sources: Sequence[Source],
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


def _values(sources: Sequence[Source], columns: Columns, shares: Floats) -> Floats:
    """(point, column) of shares in 0 ... 1 of every column."""
    out = np.zeros_like(shares)
    for source, (own, phase) in zip(sources, columns.of_source.tolist(), strict=True):
        value = source.law.quantiles(shares[:, own])
        out[:, own] = value
        if phase >= 0:
            turn = 2.0 * np.pi * shares[:, phase]
            out[:, own], out[:, phase] = value * np.cos(turn), value * np.sin(turn)
    return out
