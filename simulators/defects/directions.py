"""Random directions and typical spreads for drawing defects."""

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]
ANY_INSTRUMENT = ("dual-psd", "position", "wire", "seat")
ROBOT = ("dual-psd", "position", "wire")  # arms with drives


def direction(rng: np.random.Generator) -> Vector:
    """A unit vector, all directions alike."""
    vector = rng.standard_normal(3)
    return as_vector(vector / np.linalg.norm(vector))


def as_vector(values: NDArray[np.float64]) -> Vector:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def spread(rng: np.random.Generator, typical: float) -> float:
    """A size between half and twice the typical one, in even steps of its logarithm."""
    return float(typical * 2.0 ** rng.uniform(-1.0, 1.0))


def phase(rng: np.random.Generator) -> float:
    """An angle (rad) in (-pi, pi)."""
    return float(rng.uniform(-np.pi, np.pi))
