"""How well a nominal arm explains measured positions, whatever frame and target: fast, robust, mirrors allowed.

Frame by the weighted Procrustes solution (Umeyama, IEEE PAMI 13(4), 1991, with the sign of the determinant given
instead of chosen); target as the weighted mean of the measured points in the flange frame; both in turn. Weights are
those of the least sum of distances (Weiszfeld), so that a few outlying rows do not pull. Of several targets each is a
point of its own.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.least_distance import median, weights

Floats = NDArray[np.float64]

TURNS = 25  # of frame and target in turn; compared are factors, not digits


@dataclass(frozen=True)
class RoughFit:
    """Where the device stands and the target sits, if everything else is nominal."""

    linear: Floats  # (..., 3, 3) base to device, determinant +1, or -1 where mirrored
    shift_m: Floats  # (..., 3)
    point_m: Floats  # (..., 3) target in the flange frame; (..., target, 3) of several
    distance_m: Floats  # (..., pose) measured from expected
    typical_m: Floats  # (...) median of these


def rough_fit(T_base_flange: Floats, position_m: Floats, point_m: Floats, *, mirrored: bool = False) -> RoughFit:
    """Best frame and target for flange poses (..., pose, 4, 4) and positions (pose, 3); `point_m` (3,) is the start."""
    found = rough_fit_of_targets(
        T_base_flange, position_m, point_m[None], np.zeros(len(position_m), dtype=np.intp), mirrored=mirrored
    )
    return replace(found, point_m=found.point_m[..., 0, :])


def rough_fit_of_targets(
    T_base_flange: Floats, position_m: Floats, point_m: Floats, target: NDArray[np.intp], *, mirrored: bool = False
) -> RoughFit:
    """The same of several: starts (target, 3), and which of them each pose is of, (pose,) from 0."""
    of = np.arange(len(point_m))[:, None] == target  # (target, pose)
    R, t = T_base_flange[..., :3, :3], T_base_flange[..., :3, 3]
    weight, distance = np.ones(t.shape[:-1]), np.zeros(t.shape[:-1])
    linear, shift = np.eye(3), np.zeros(3)
    tip = (R @ point_m[target, :, None])[..., 0] + t
    for _ in range(TURNS):
        linear, shift = frame_between(tip, position_m, weight, mirrored=mirrored)
        in_base = (position_m - shift[..., None, :]) @ linear
        in_flange = ((in_base - t)[..., None, :] @ R)[..., 0, :]
        point_m = averaged(in_flange[..., None, :, :], np.where(of, weight[..., None, :], 0.0))
        tip = (R @ point_m[..., target, :, None])[..., 0] + t
        distance = np.linalg.norm(tip - in_base, axis=-1)
        weight = weights(distance)
    return RoughFit(linear, shift, point_m, distance, median(distance))


def averaged(points_m: Floats, weight: Floats) -> Floats:
    """(..., 3) of points (..., point, 3) by weights (..., point)."""
    share = weight / weight.sum(axis=-1, keepdims=True)
    return np.asarray((share[..., None, :] @ points_m)[..., 0, :])


def frame_between(a_m: Floats, b_m: Floats, weight: Floats, *, mirrored: bool = False) -> tuple[Floats, Floats]:
    """(linear (..., 3, 3), shift (..., 3)) with linear @ a + shift nearest to b, both (..., point, 3), by weights."""
    middle_a, middle_b = averaged(a_m, weight), averaged(b_m, weight)
    linear = turn_between(a_m - middle_a[..., None, :], b_m - middle_b[..., None, :], weight, mirrored=mirrored)
    return linear, middle_b - (linear @ middle_a[..., None])[..., 0]


def turn_between(a: Floats, b: Floats, weight: Floats, *, mirrored: bool = False) -> Floats:
    """(..., 3, 3) linear with linear @ a nearest to b, both (..., vector, 3), weights (..., vector)."""
    return nearest_turn(np.swapaxes(b * weight[..., None], -1, -2) @ a, mirrored=mirrored)


def nearest_turn(matrix: Floats, *, mirrored: bool = False) -> Floats:
    """The rotation, or reflection, (..., 3, 3) nearest to matrices (..., 3, 3)."""
    U, _, Vt = np.linalg.svd(matrix)
    U[..., 2] *= (np.sign(np.linalg.det(U @ Vt)) * (-1.0 if mirrored else 1.0))[..., None]
    return np.asarray(U @ Vt, dtype=np.float64)
