"""The laser on the flange (a line with four unknowns), and where its line meets two mirror-like faces or other lines.

A face's frame has x, y in the face and z along its outward normal. A specular reflection at z = 0 is the map
diag(1, 1, -1): the reflected ray is the mirror image of the straight continuation. So for each face and each order
there is ONE affine map from the base to "the face as the unreflected beam sees it", and every spot is the meeting of
a straight line with z = 0. Source: method of images; the mirror image of the second centre is the construction of Du,
Xi, Nieves, Int. J. Smart Sensing Intell. Syst. 5(4), 2012.

The unknowns of the laser are two shifts across the beam and two tilts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.parameters import Parameter
from calibrate.model.rigid import cross, cross_matrix, inverse

Floats = NDArray[np.float64]
MIRROR_Z = np.diag([1.0, 1.0, -1.0, 1.0])
SHIFT_PLAUSIBLE_M = 5e-3  # a hand-fitted bracket; only scales columns and decides when a sigma is no result
TILT_PLAUSIBLE_RAD = 0.05
N_PARAMETERS = 4
CENTRED_M = 1e-4  # a spot farther off moves the line by more than the tolerance of a 5 µm centring can explain


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


@dataclass(frozen=True)
class LaserMount:
    """Nominal beam, in the flange frame, and two axes u, v across it.

    origin = origin_m + shift_u u + shift_v v;  direction = direction + tilt_u u + tilt_v v (not of unit length: tilts
    are tangents). Sliding along the beam and turning about it change nothing, so they are no parameters.
    """

    origin_m: Floats  # (3,)
    direction: Floats  # (3,) unit
    u: Floats  # (3,) unit
    v: Floats  # (3,) unit

    @classmethod
    def from_drawing(cls, origin_m: Floats, direction: Floats) -> "LaserMount":
        """Axis u is the flange axis most across the beam, made perpendicular; v = direction x u."""
        d = direction / np.linalg.norm(direction)
        axis = np.eye(3)[int(np.argmin(np.abs(d)))]
        u = axis - (axis @ d) * d
        u = u / np.linalg.norm(u)
        return cls(np.asarray(origin_m, dtype=float), d, u, cross(d, u))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("laser.shift_u", "m", SHIFT_PLAUSIBLE_M),
            Parameter("laser.shift_v", "m", SHIFT_PLAUSIBLE_M),
            Parameter("laser.tilt_u", "rad", TILT_PLAUSIBLE_RAD),
            Parameter("laser.tilt_v", "rad", TILT_PLAUSIBLE_RAD),
        )

    def in_flange(self, mount: Floats) -> tuple[Floats, Floats]:
        """Origin and direction (3,), (3,) in the flange frame for the four values."""
        return (
            self.origin_m + mount[0] * self.u + mount[1] * self.v,
            self.direction + mount[2] * self.u + mount[3] * self.v,
        )

    def beam(self, mount: Floats, T_base_flange: Floats) -> Beam:
        """Beams in the base frame at flange poses (pose, 4, 4)."""
        origin, direction = self.in_flange(mount)
        R = T_base_flange[:, :3, :3]
        return Beam(R @ origin + T_base_flange[:, :3, 3], R @ direction)


@dataclass(frozen=True)
class Lines:
    """Laser lines in the base frame and how they move with the parameters."""

    point_m: Floats  # (line, 3)
    direction: Floats  # (line, 3) unit
    point_by: Floats  # (line, 3, param) derivative of the point
    direction_by: Floats  # (line, 3, param) derivative of the direction, across it

    def select(self, rows: list[int]) -> "Lines":
        """Some of the lines."""
        return Lines(self.point_m[rows], self.direction[rows], self.point_by[rows], self.direction_by[rows])


def nearest_point(lines: Lines) -> tuple[Floats, Floats]:
    """Point (3,) with the least sum of squared distances to the lines, and its derivative (3, param).

    c = (sum P_k)^-1 sum P_k p_k with P_k = 1 - d_k d_k'; of two lines it is the middle of their common perpendicular.
    LinAlgError where all lines are parallel. Source: normal equations of sum |P_k (c - p_k)|^2.
    """
    across = _across(lines.direction)
    normal = across.sum(axis=0)
    point = np.linalg.solve(normal, np.einsum("kij,kj->i", across, lines.point_m))
    moved = np.einsum("kij,kjm->im", across, lines.point_by) - _turned(lines, point).sum(axis=0)
    return point, np.linalg.solve(normal, moved)


def distances(lines: Lines) -> tuple[Floats, Floats]:
    """Vectors (line, 3) square to each line, to the point nearest to all; and derivative (line, 3, param)."""
    point, point_by = nearest_point(lines)
    across = _across(lines.direction)
    offset = np.einsum("kij,kj->ki", across, point - lines.point_m)
    return offset, across @ (point_by - lines.point_by) + _turned(lines, point)


def _across(direction: Floats) -> Floats:
    """(line, 3, 3) projectors on the plane across each line."""
    return np.eye(3) - direction[:, :, None] * direction[:, None, :]


def _turned(lines: Lines, point: Floats) -> Floats:
    """(line, 3, param) change of P_k (point - p_k) by turning P_k alone."""
    lever = point - lines.point_m
    along = np.einsum("ki,ki->k", lines.direction, lever)
    sideways = np.einsum("kim,ki->km", lines.direction_by, lever)
    return -(lines.direction_by * along[:, None, None] + lines.direction[:, :, None] * sideways[:, None, :])
