"""What no model can explain: the noise that the concealing side really added, known because exact readings are."""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import POSITION, SPOTS
from calibeam.prove.truth import Truth

Floats = NDArray[np.float64]

CHANNELS: dict[str, tuple[str, ...]] = {"dual-psd": SPOTS, "tracker": POSITION, "wire": ("wire_m",)}
WILD = 6.0  # sigmas: rows that every side of the comparison leaves out


def floor_m(samples: Samples, truth: Truth, family: str) -> float | None:
    """Rms over all readings but wild ones, m. None for cones: their noise is in the encoders."""
    if family not in CHANNELS:
        return None
    recorded = np.stack([samples.column(name) for name in CHANNELS[family]], axis=1)
    noise: Floats = recorded - np.array(truth.exact.values_m)
    size = np.max(np.abs(noise), axis=1)
    middle = float(np.median(np.abs(noise))) / 0.6745
    return float(np.sqrt(np.mean(noise[size <= WILD * middle] ** 2)))
