"""Linear propagation: mean and covariance of the probe's error from those of the sources, pose by pose.

e = sum of by_column x columns; columns are independent. Source: law of propagation, JCGM 100:2008, ch. 5.1.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.source import Source

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


def propagate(machine: Machine, sources: Sequence[Source], q_rad: Floats) -> Linear:
    """At readings (pose, joint)."""
    by_slot = machine.by_slot(q_rad)
    mean, covariance = np.zeros((len(sources), len(q_rad), 3)), np.zeros((len(sources), len(q_rad), 3, 3))
    for i, source in enumerate(sources):
        by, (first, second) = source.by_column(by_slot, q_rad), source.moments
        mean[i] = by @ first
        covariance[i] = (by * second) @ np.swapaxes(by, 1, 2)
    return Linear(mean, covariance)
