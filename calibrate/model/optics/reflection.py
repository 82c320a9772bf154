"""Where a laser line meets two mirror-like faces, by unfolding the reflection.

A face's frame has x, y in the face and z along its outward normal. A specular reflection at z = 0 is the map
diag(1, 1, -1): the reflected ray is the mirror image of the straight continuation. So for each face and each order
there is ONE affine map from the base to "the face as the unreflected beam sees it", and every spot is the meeting of
a straight line with z = 0. Source: method of images; the mirror image of the second centre is the construction of Du,
Xi, Nieves, Int. J. Smart Sensing Intell. Syst. 5(4), 2012.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.rigid import cross_matrix, inverse

Floats = NDArray[np.float64]

MIRROR_Z = np.diag([1.0, 1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Beam:
    """Laser lines in the base frame, one (3,) or many (pose, 3); the length of the direction does not move a spot."""

    origin_m: Floats
    direction: Floats


@dataclass(frozen=True)
class Strike:
    """Meeting of each beam with the planes of both faces; of one beam all without the first axis."""

    spots_m: Floats  # (pose, 2, 2): face, x y
    travel_m: Floats  # (pose, 2) signed path from the laser in units of |direction|; negative: behind the laser
    facing: Floats  # (pose, 2) z component of the arriving direction in the face's frame; light comes in when < 0
    slope: Floats  # (pose, 2, 2, 3) d spot / d beam origin in the base frame
    continuation_m: Floats  # (pose, 2, 3) where the unreflected beam would be after `travel_m`, base frame


def unfolded_faces(T_base_psd1: Floats, T_psd1_psd2: Floats, first_psd: int) -> Floats:
    """(..., 2, 4, 4) maps from the base to face 1 and face 2 as the beam sees them when it strikes `first_psd` first.

    For one fixture pose (4, 4), or many (..., 4, 4).
    """
    T_psd1_base, T_psd2_psd1 = inverse(T_base_psd1), inverse(T_psd1_psd2)
    if first_psd == 1:
        return np.stack([T_psd1_base, T_psd2_psd1 @ MIRROR_Z @ T_psd1_base], axis=-3)
    T_psd2_base = T_psd2_psd1 @ T_psd1_base
    return np.stack([T_psd1_psd2 @ MIRROR_Z @ T_psd2_base, T_psd2_base], axis=-3)


def strike(beam: Beam, faces: Floats) -> Strike:
    """Spots of every beam on both planes; `faces` (pose, 2, 4, 4), of one beam (2, 4, 4), from `unfolded_faces`.

    A beam parallel to a plane gives infinite values without a warning: the caller sees it in `facing` being 0.
    """
    linear = faces[..., :3, :3]
    p = (linear @ beam.origin_m[..., None, :, None])[..., 0] + faces[..., :3, 3]
    d = (linear @ beam.direction[..., None, :, None])[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        travel = -p[..., 2] / d[..., 2]
        lean = d[..., :2] / d[..., 2:]  # spot shift per rise of the beam's origin off the face
        spots = p[..., :2] + travel[..., None] * d[..., :2]
        slope = linear[..., :2, :] - lean[..., None] * linear[..., 2:, :]
        continuation = beam.origin_m[..., None, :] + travel[..., None] * beam.direction[..., None, :]
    return Strike(spots, travel, d[..., 2], slope, continuation)


def by_beam(hit: Strike) -> Floats:
    """(..., 4, 6) derivative of the spots by origin and direction of the beam."""
    both = np.concatenate([hit.slope, hit.travel_m[..., None, None] * hit.slope], axis=-1)
    return both.reshape(*both.shape[:-3], 4, 6)


def by_twist(slope: Floats, point_m: Floats) -> Floats:
    """(..., 2, 6) derivative of a spot by a twist of the beam, whose point (..., 3) it moves by v + w x point."""
    return np.concatenate([slope, -slope @ cross_matrix(point_m)], axis=-1)


def is_lit(hit: Strike, first_psd: NDArray[np.int64], half_size_m: float) -> NDArray[np.bool_]:
    """(pose, 2) True where the spot is on the face, from its front, ahead of the laser and in the stated order."""
    on_face = np.all(np.abs(hit.spots_m) <= half_size_m, axis=-1)
    ahead = (hit.travel_m > 0.0) & (hit.facing < 0.0)
    first_nearer = np.where(
        first_psd == 1, hit.travel_m[:, 0] < hit.travel_m[:, 1], hit.travel_m[:, 1] < hit.travel_m[:, 0]
    )
    return on_face & ahead & first_nearer[:, None]
