"""How well a nominal arm explains measured positions, whatever frame and target: fast, robust, mirrors allowed.

Frame by the weighted Procrustes solution (Umeyama, IEEE PAMI 13(4), 1991, with the sign of the determinant given
instead of chosen); target as the weighted mean of the measured points in the flange frame; both in turn. Weights are
those of the least sum of distances (Weiszfeld), so that a few outlying rows do not pull.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.least_distance import weights

Floats = NDArray[np.float64]

TURNS = 25  # of frame and target in turn; compared are factors, not digits


@dataclass(frozen=True)
class RoughFit:
    """Where the device stands and the target sits, if everything else is as drawn."""

    linear: Floats  # (3, 3) base to device, determinant +1, or -1 where mirrored
    shift_m: Floats  # (3,)
    point_m: Floats  # (3,) target in the flange frame
    distance_m: Floats  # (pose,) measured from expected
    typical_m: float  # median of these


def rough_fit(T_base_flange: Floats, position_m: Floats, point_m: Floats, *, mirrored: bool = False) -> RoughFit:
    """Best frame and target for flange poses (pose, 4, 4) and positions (pose, 3); `point_m` (3,) is the start."""
    R, t = T_base_flange[:, :3, :3], T_base_flange[:, :3, 3]
    weight = np.ones(len(t))
    linear, shift, distance = np.eye(3), np.zeros(3), np.zeros(len(t))
    for _ in range(TURNS):
        tip = R @ point_m + t
        linear, shift = frame_between(tip, position_m, weight, mirrored=mirrored)
        in_base = (position_m - shift) @ linear
        point_m = np.average(np.einsum("nji,nj->ni", R, in_base - t), axis=0, weights=weight)
        distance = np.linalg.norm(R @ point_m + t - in_base, axis=1)
        weight = weights(distance)
    return RoughFit(linear, shift, point_m, distance, float(np.median(distance)))


def frame_between(a_m: Floats, b_m: Floats, weight: Floats, *, mirrored: bool = False) -> tuple[Floats, Floats]:
    """(linear (3, 3), shift (3,)) with linear @ a + shift nearest to b, both (point, 3), weights (point,)."""
    middle_a, middle_b = np.average(a_m, axis=0, weights=weight), np.average(b_m, axis=0, weights=weight)
    linear = turn_between(a_m - middle_a, b_m - middle_b, weight, mirrored=mirrored)
    return linear, middle_b - linear @ middle_a


def turn_between(a: Floats, b: Floats, weight: Floats, *, mirrored: bool = False) -> Floats:
    """(3, 3) linear with linear @ a nearest to b, both (vector, 3), weights (vector,)."""
    U, _, Vt = np.linalg.svd((b * weight[:, None]).T @ a)
    sign = np.sign(np.linalg.det(U @ Vt)) * (-1.0 if mirrored else 1.0)
    return np.asarray((U * [1.0, 1.0, sign]) @ Vt, dtype=np.float64)
