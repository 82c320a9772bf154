"""Noise that wanders slowly: white noise plus a first-order autoregression, along the order of capture.

Source: Brockwell, Davis, Time Series: Theory and Methods, 1991, sections 3.1 and 4.4.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]

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
        white = rng.standard_normal(shape)
        if self.share == 0.0:
            return white
        shocks = rng.standard_normal(shape)
        shocks[1:] *= np.sqrt(1.0 - self.rho**2)
        slow = np.asarray(lfilter([1.0], [1.0, -self.rho], shocks, axis=0))
        return np.sqrt(1.0 - self.share) * white + np.sqrt(self.share) * slow
