"""Cones on the table and bars that are held about: the seats of a measuring arm's session."""

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.rig import Artefacts

Floats = NDArray[np.float64]
BAR_CHANCE = 0.6
HOLDINGS = 12  # of each bar
BAR_SIGMA_M = 1e-6  # a calibrated bar; ISO 10360-12 asks for a fifth of what it tests


def artefacts(cone_m: Floats, reach_m: float, rng: np.random.Generator) -> Artefacts:
    """The cones (cone, 3), and in most sessions one or two bars, held in many directions within reach."""
    count = int(rng.integers(1, 3)) if rng.random() < BAR_CHANCE else 0
    bar_m = np.round(reach_m * rng.uniform(0.35, 0.7, count), 6)
    held = np.tile(np.arange(count), HOLDINGS)  # in turns
    middle_m = reach_m * rng.uniform(0.35, 0.6, (held.size, 1)) * _unit(held.size, rng)
    middle_m[:, 2] = np.abs(middle_m[:, 2])
    half_m = 0.5 * bar_m[held][:, np.newaxis] * _unit(held.size, rng)
    ends_m = np.stack((middle_m - half_m, middle_m + half_m), axis=1).reshape(-1, 3)
    return Artefacts(np.concatenate((cone_m, ends_m)), len(cone_m), bar_m, held)


def _unit(rows: int, rng: np.random.Generator) -> Floats:
    vector = rng.standard_normal((rows, 3))
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)
