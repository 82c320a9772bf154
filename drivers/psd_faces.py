"""From the currents of one face of a position-sensitive detector to spot, light and doubt.

A face is one kind of electrode layout with one formula; the next kind is its formula and one line in FORMULAS.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class FaceKind(IntEnum):
    """Electrode layout; the numbers are those of the DAQ protocol."""

    DUO_LATERAL = 1
    TETRA_LATERAL = 2
    QUADRANT = 3


@dataclass(frozen=True)
class Reading:
    """A spot on one face, each of shape (...): one for every set of four currents."""

    x_m: Floats
    y_m: Floats
    sum_a: Floats  # the photocurrent


@dataclass(frozen=True)
class MeanReading:
    """The spot of averaged currents, with the standard deviation of the mean from the scatter of the samples."""

    x_m: float
    y_m: float
    sum_a: float
    x_sigma_m: float
    y_sigma_m: float
    samples: int


def duo_lateral(current_a: ArrayLike, length_m: float) -> Reading:
    """Spot on a duo-lateral face from currents (..., 4) A in the order x1, x2, y1, y2; NaN where there is no current.

    x = (L/2) (X2 - X1) / (X1 + X2), y likewise, L from electrode to electrode; the layers of x and y carry the same
    photocurrent, so its best value is the mean of both sums. Source: On-Trak Photonics, "PSD theory", duo-lateral.
    """
    current = np.asarray(current_a, dtype=np.float64)
    if current.shape[-1:] != (4,):
        raise ValueError(f"currents of shape {current.shape}; the last axis must be x1, x2, y1, y2")
    sums = current[..., 0::2] + current[..., 1::2]
    differences = current[..., 1::2] - current[..., 0::2]
    spot = 0.5 * length_m * _ratio(differences, sums)
    return Reading(spot[..., 0], spot[..., 1], sums.mean(axis=-1))


FORMULAS: Mapping[FaceKind, Callable[[ArrayLike, float], Reading]] = {FaceKind.DUO_LATERAL: duo_lateral}


def read_face(kind: FaceKind, current_a: ArrayLike, length_m: float) -> Reading:
    """Spot by the formula of `kind`. ValueError when there is none yet."""
    if kind not in FORMULAS:
        known = ", ".join(known.name for known in FORMULAS)
        raise ValueError(f"PSD face of kind {kind.name}: no formula; this version reads {known}")
    return FORMULAS[kind](current_a, length_m)


def mean_face(kind: FaceKind, current_a: ArrayLike, length_m: float) -> MeanReading:
    """Spot of the averaged currents of (sample, 4) A, at least 2 samples: currents are averaged, not positions.

    Position is a ratio, so a mean of positions is biased by the noise of the sum; the ratio of means is not, to first
    order. Its sigma: s^2 = sum of (x_i w_i - x w_i)^2 / (n (n - 1)), w_i = light of sample i over the mean light.
    Source: W. G. Cochran, Sampling Techniques, 3rd ed. 1977, section 2.11 (ratio estimate and its variance), without
    the correction for a finite population. Holds for samples that are independent of each other.
    """
    current = np.asarray(current_a, dtype=np.float64)
    if current.ndim != 2 or len(current) < 2:
        raise ValueError(f"currents of shape {current.shape}; a mean with its sigma needs (sample >= 2, 4)")
    mean = read_face(kind, current.mean(axis=0), length_m)
    each = read_face(kind, current, length_m)
    weight = _ratio(each.sum_a, mean.sum_a)
    return MeanReading(
        float(mean.x_m),
        float(mean.y_m),
        float(mean.sum_a),
        _sigma_of_mean(weight * (each.x_m - mean.x_m)),
        _sigma_of_mean(weight * (each.y_m - mean.y_m)),
        len(current),
    )


def _sigma_of_mean(residual: Floats) -> float:
    count = len(residual)
    return float(np.sqrt(np.sum(residual**2) / (count * (count - 1))))


def _ratio(numerator: Floats, denominator: Floats) -> Floats:
    lit = denominator != 0.0
    return np.divide(numerator, denominator, out=np.full(np.broadcast(numerator, denominator).shape, np.nan), where=lit)
