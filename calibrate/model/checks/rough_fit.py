"""How well a nominal arm explains measured positions, whatever frame and target: fast, robust, mirrors allowed.

Frame by weighted rigid alignment, with a mirror where asked; target as the weighted mean of the measured points in the
flange frame; both in turn. Weights are those of the least sum of distances (Weiszfeld), so that a few outlying rows do
not pull. Of several targets each is a point of its own.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.model.alignment import rigid_motion, weighted_mean
from calibrate.model.checks.least_distance import median, weights

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
        T_device_base = rigid_motion(position_m, tip, weight, mirrored=mirrored)
        linear, shift = T_device_base[..., :3, :3], T_device_base[..., :3, 3]
        in_base = (position_m - shift[..., None, :]) @ linear
        in_flange = ((in_base - t)[..., None, :] @ R)[..., 0, :]
        point_m = weighted_mean(in_flange[..., None, :, :], np.where(of, weight[..., None, :], 0.0))
        tip = (R @ point_m[..., target, :, None])[..., 0] + t
        distance = np.linalg.norm(tip - in_base, axis=-1)
        weight = weights(distance)
    return RoughFit(linear, shift, point_m, distance, median(distance))
