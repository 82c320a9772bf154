"""Drawn arms: the error of the probe without any linearisation, for any law; memory does not grow with their number.

Arm number k of a seed is the same whoever draws it, and sums are put together in the order of the arms: the answer
does not depend on the number of workers, to the last bit.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from calibrate.error_simulation.columns import arm_at, columns_of
from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.source import Source
from calibrate.kernels.perturbed import BINS, Counted, count_arms

Floats = NDArray[np.float64]
Progress = Callable[[int, int], None]

CHUNK = 1 << 14  # arms; of a fixed size, so that sums are the same whoever adds them
AHEAD = 4  # chunks a worker may be ahead of the sum: what bounds the memory
REACH = 8.0  # of the linear rms: lengths beyond fall into the last bin of a histogram


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
    sources: Sequence[Source],
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
        return count_arms(arm, columns.drawn, nominal, bin_m, first, min(CHUNK, arms - first), seed)

    total: Counted | None = None
    for part in _in_order(count, range(0, arms, CHUNK), workers):
        total = part if total is None else total.plus(part)
        progress(total.arms, arms)
    if total is None:
        raise ValueError(f"{arms} arms: draw at least one")
    return _summed(total, bin_m)


def _in_order(count: Callable[[int], Counted], firsts: range, workers: int) -> Iterator[Counted]:
    if workers == 1:
        yield from map(count, firsts)
        return
    left = iter(firsts)
    with ThreadPoolExecutor(workers) as pool:
        while wave := list(islice(left, AHEAD * workers)):
            yield from pool.map(count, wave)


def _summed(counted: Counted, bin_m: Floats) -> Drawn:
    s = counted.sums / counted.arms
    second = s[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)
    mean = s[:, :3]
    covariance = second - mean[:, :, None] * mean[:, None, :]
    return Drawn(counted.arms, mean, covariance, s[:, 9], counted.worst_m, counted.worst_arm, bin_m, counted.histogram)
