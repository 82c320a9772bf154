"""Noise of a dual-PSD observation: joint repeatability seen through the arm, and noise of the detectors.

cov_j = joint^2 G_j G_j' + psd^2 diag(w_j^2), G_j = d spots / d joints (4, joint), w_j the stated sigma of the spots.
Both factors are estimated from the residuals by restricted maximum likelihood (calibrate/variance.py).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.variance import VarianceFactors, as_believed

Floats = NDArray[np.float64]

BELIEVED = as_believed(2)


@dataclass(frozen=True)
class NoiseModel:
    """Believed sizes; the data correct them."""

    joint_rad: float
    psd_m: Floats  # (pose, 4) stated sigma of the averaged spots

    def parts(self, by_joint: Floats) -> Floats:
        """(2, pose, 4, 4) covariance by joints and by detectors at the believed sizes, from d spots / d joints."""
        return parts_of(by_joint, self.joint_rad, self.psd_m)


def parts_of(by_joint: Floats, joint_rad: float, own_sigma: Floats) -> Floats:
    """(2, row, k, k) covariance by joints, and by the instrument alone with its stated sigmas (row, k)."""
    arm = joint_rad**2 * by_joint @ np.swapaxes(by_joint, 1, 2)
    own = np.zeros_like(arm)
    each = range(own_sigma.shape[1])
    own[:, each, each] = own_sigma**2
    return np.stack([arm, own])


def total(parts: Floats, factors: VarianceFactors) -> Floats:
    """(pose, k, k) covariance of the noise."""
    return np.einsum("k,knij->nij", np.exp(factors.log_variance), parts)
