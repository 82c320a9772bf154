"""Known lengths between the places of a fixture: the source of scale."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.belief import KnownDistance
from simulators.conceal.rig import DualPsd, TrueRig

Floats = NDArray[np.float64]
DISTANCE_SIGMA_M = 20e-6  # a length bar or a tracker over less than 2 m


def measure_distances(true: TrueRig, rng: np.random.Generator) -> list[KnownDistance]:
    """Each place measured against the one before, and the last against the first."""
    instrument = true.instrument
    if not isinstance(instrument, DualPsd) or len(instrument.places) < 2:
        return []
    count = len(instrument.places)
    pairs = [(k, k + 1) for k in range(1, count)] + ([(1, count)] if count > 2 else [])
    centre_m = instrument.places[:, :3, 3]
    return [
        KnownDistance(
            a,
            b,
            float(np.linalg.norm(centre_m[a - 1] - centre_m[b - 1]) + DISTANCE_SIGMA_M * rng.standard_normal()),
            DISTANCE_SIGMA_M,
        )
        for a, b in pairs
    ]


def in_sigmas(rig: TrueRig, distances: Sequence[KnownDistance]) -> Floats:
    """The same lengths of any rig, each in units of its sigma, (distance,)."""
    if not isinstance(rig.instrument, DualPsd):
        return np.empty(0)
    centre_m = rig.instrument.places[:, :3, 3]
    return np.array(
        [float(np.linalg.norm(centre_m[one.first - 1] - centre_m[one.second - 1])) / one.sigma_m for one in distances]
    )
