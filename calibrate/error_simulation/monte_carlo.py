"""Drawn arms: the error of the probe without any linearisation, for any law; memory does not grow with their number.

Arms are drawn in chunks of a fixed size, each by a generator of its own (numpy's, seeded by seed and chunk). Sums are
put together in the order of the chunks, so the answer does not depend on the number of workers, to the last bit.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from calibrate.error_simulation.machine import (
    ArmAtPoses,
    Columns,
    Machine,
    arm_at,
    columns_of,
)
from calibrate.error_simulation.sources import ErrorSource

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Progress = Callable[[int, int], None]

CHUNK = 1 << 12  # arms: what is held of them at a time stays in the cache
BINS = 512  # of a histogram of error lengths, beside one for what is longer
AHEAD = 4  # chunks a worker may be ahead of the sum: what bounds the memory
REACH = 8.0  # of the linear rms: lengths beyond fall into the last bin of a histogram


@dataclass(frozen=True)
class Counted:
    """Sums over drawn arms; two of them add up to that of all their arms."""

    arms: int
    mean_sum: Floats  # (pose, 3)
    square_sum: Floats  # (pose, 3, 3)
    length_sum: Floats  # (pose,)
    histogram: Ints  # (pose, BINS + 1) of error lengths, the last bin for what is longer
    worst_m: Floats  # (pose,)
    worst_arm: Ints  # (pose,) its number

    def plus(self, other: "Counted") -> "Counted":
        """Of equally bad arms the first one is reported."""
        longer = other.worst_m > self.worst_m
        return Counted(
            self.arms + other.arms,
            self.mean_sum + other.mean_sum,
            self.square_sum + other.square_sum,
            self.length_sum + other.length_sum,
            self.histogram + other.histogram,
            np.where(longer, other.worst_m, self.worst_m),
            np.where(longer, other.worst_arm, self.worst_arm),
        )


@dataclass(frozen=True)
class Drawn:
    """What so many arms gave at every pose."""

    arms: int
    mean_m: Floats  # (pose, 3)
    covariance_m2: Floats  # (pose, 3, 3)
    mean_length_m: Floats  # (pose,)
    worst_m: Floats  # (pose,)
    worst_arm: NDArray[np.int64]  # (pose,) its number
    bin_m: Floats  # (pose,) width of a bin
    histogram: NDArray[np.int64]  # (pose, BINS + 1)

    @property
    def rms_m(self) -> Floats:
        """(pose,) three axes together."""
        return np.sqrt(np.sum(self.mean_m**2, axis=1) + np.trace(self.covariance_m2, axis1=1, axis2=2))

    @property
    def sigma_m(self) -> Floats:
        """(pose, 3) by axis, about the mean."""
        return np.sqrt(np.diagonal(self.covariance_m2, axis1=1, axis2=2))

    def quantile_m(self, share: float) -> Floats:
        """(pose,) length that this share of the arms stays below, to a bin; the longest where it lies beyond them."""
        reached = np.cumsum(self.histogram, axis=1) >= share * self.arms
        cell = np.argmax(reached, axis=1)
        return np.where(cell < BINS, np.minimum((cell + 1) * self.bin_m, self.worst_m), self.worst_m)


def draw_arms(
    machine: Machine,
    sources: Sequence[ErrorSource],
    q_rad: Floats,
    arms: int,
    *,
    seed: int,
    rms_m: Floats,
    workers: int = 1,
    progress: Progress = lambda done, total: None,
) -> Drawn:
    """So many arms at readings (pose, joint); `rms_m` (pose,) as linear propagation expects it gives the bins."""
    columns = columns_of(sources)
    arm = arm_at(machine, sources, columns, q_rad)
    nominal, bin_m = arm.nominal_m(), np.maximum(REACH * rms_m / BINS, 1e-15)

    def count(first: int) -> Counted:
        return count_chunk(arm, columns, nominal, bin_m, first // CHUNK, min(CHUNK, arms - first), seed)

    total: Counted | None = None
    for part in _in_order(count, range(0, arms, CHUNK), workers):
        total = part if total is None else total.plus(part)
        progress(total.arms, arms)
    if total is None:
        raise ValueError(f"{arms} arms: draw at least one")
    return _summed(total, bin_m)


def count_chunk(
    arm: ArmAtPoses, columns: Columns, nominal_m: Floats, bin_m: Floats, chunk: int, arms: int, seed: int
) -> Counted:
    """The arms of one chunk of a seed, at all poses; bins (pose,) of the histograms."""
    X = columns.draw(np.random.Generator(np.random.SFC64([seed, chunk])), CHUNK)[:, :arms]
    poses = len(nominal_m)
    mean, square, length_sum = np.empty((poses, 3)), np.empty((poses, 3, 3)), np.empty(poses)
    histogram, worst_m, worst = np.empty((poses, BINS + 1), np.int64), np.empty(poses), np.empty(poses, np.int64)
    for pose in range(poses):
        error = arm.probes_m(pose, X)
        error -= nominal_m[pose][:, None]
        length = np.sqrt(np.einsum("ik,ik->k", error, error))
        mean[pose], length_sum[pose] = error.sum(axis=1), length.sum()
        square[pose] = np.einsum("ik,jk->ij", error, error)
        bins = np.minimum(length / bin_m[pose], BINS).astype(np.int64)
        histogram[pose] = np.bincount(bins, minlength=BINS + 1)
        worst[pose] = np.argmax(length)
        worst_m[pose] = length[worst[pose]]
    return Counted(arms, mean, square, length_sum, histogram, worst_m, worst + chunk * CHUNK)


def _in_order(count: Callable[[int], Counted], firsts: range, workers: int) -> Iterator[Counted]:
    if workers == 1:
        yield from map(count, firsts)
        return
    left = iter(firsts)
    with ThreadPoolExecutor(workers) as pool:
        while wave := list(islice(left, AHEAD * workers)):
            yield from pool.map(count, wave)


def _summed(counted: Counted, bin_m: Floats) -> Drawn:
    mean = counted.mean_sum / counted.arms
    covariance = counted.square_sum / counted.arms - mean[:, :, None] * mean[:, None, :]
    length_m = counted.length_sum / counted.arms
    return Drawn(counted.arms, mean, covariance, length_m, counted.worst_m, counted.worst_arm, bin_m, counted.histogram)
