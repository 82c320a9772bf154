"""Rigid alignment of points, and start values in closed form: a frame, a tool point, a drum.

`rigid_motion` is the one place where points are brought onto points. No iteration from a guess: any place of the device
is found. Sources: Arun, Huang, Blostein, IEEE PAMI 9(5), 1987 (singular values); Umeyama, IEEE PAMI 13(4), 1991 (sign
of the determinant); trilateration by differences of squared lengths is linear algebra.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

FLAT = 1e-6  # of the largest extent of a set of points: below it lies on a line (or in a plane), rounding aside
ROUNDS = 10  # of leaving out shots far off; two or three are enough where most of the shots are good
FAR = 5.0  # medians of the residual: one good shot of 1e4 lies farther off (Maxwell law), so few good ones are lost
CLEARLY = 0.5  # of the other rms: a flat set of points with noise prefers one hand by a hair only
GROSS = 0.05  # of the usual distance from the middle: more than an arm beside its drawing explains


def rigid_motion(
    points_a_m: Floats, points_b_m: Floats, weight: Floats | None = None, *, mirrored: bool = False
) -> Floats:
    """(..., 4, 4) T_a_b that brings points b onto the same points in a with the least weighted sum of squares.

    Points (..., point, 3) in m, weights (..., point) or None for equal ones; sets before the last axes are broadcast
    and solved side by side. The linear part is a rotation; if `mirrored`, a reflection (determinant -1).
    Raises nothing: for fewer than 3 points, or points on a line, the turn about the line is open and one of the best
    motions is returned; the distances that remain are the same for all of them. `align` raises DataError there.
    """
    middle_a, middle_b = weighted_mean(points_a_m, weight), weighted_mean(points_b_m, weight)
    linear = best_rotation(
        points_a_m - middle_a[..., None, :], points_b_m - middle_b[..., None, :], weight, mirrored=mirrored
    )
    T_a_b = np.zeros((*linear.shape[:-2], 4, 4))
    T_a_b[..., :3, :3] = linear
    T_a_b[..., :3, 3] = middle_a - (linear @ middle_b[..., None])[..., 0]
    T_a_b[..., 3, 3] = 1.0
    return T_a_b


def aligned_difference(points_a_m: Floats, points_b_m: Floats) -> Floats:
    """(point, 3) what remains after the best rigid motion: b as moved onto a, less a. Both (point, 3), in m."""
    return _difference(rigid_motion(points_a_m, points_b_m), points_a_m, points_b_m)


def best_rotation(
    vectors_a: Floats, vectors_b: Floats, weight: Floats | None = None, *, mirrored: bool = False
) -> Floats:
    """(..., 3, 3) R_a_b that brings directions, or centred points, b best onto a, both (..., vector, 3): no shift."""
    weighed = vectors_a if weight is None else vectors_a * weight[..., None]
    return nearest_rotation(np.swapaxes(weighed, -1, -2) @ vectors_b, mirrored=mirrored)


def nearest_rotation(matrix: Floats, *, mirrored: bool = False) -> Floats:
    """(..., 3, 3) the rotation, or the reflection if `mirrored`, nearest to matrices (..., 3, 3)."""
    U, _, Vt = np.linalg.svd(matrix)
    U[..., 2] *= (np.sign(np.linalg.det(U @ Vt)) * (-1.0 if mirrored else 1.0))[..., None]
    return np.asarray(U @ Vt, dtype=np.float64)


def weighted_mean(points_m: Floats, weight: Floats | None) -> Floats:
    """(..., 3) of points (..., point, 3) by weights (..., point); None: equal ones."""
    if weight is None:
        return np.asarray(points_m.mean(axis=-2), dtype=np.float64)
    share = weight / weight.sum(axis=-1, keepdims=True)
    return np.asarray((share[..., None, :] @ points_m)[..., 0, :], dtype=np.float64)


@dataclass(frozen=True)
class Alignment:
    """A rigid motion from points seen in b to the same points in a, and what speaks against it."""

    T_a_b: Floats  # (4, 4)
    rms_m: float  # of the distances, of the points used
    mirrored_rms_m: float  # the same for the mirror image of b's points; `T_a_b` is always a rotation
    determinant: float  # +1 or -1: the best orthogonal map is a rotation or a mirror; 0: points in a plane decide none
    used: Bools  # (point,) False: so far off that it was left out of the start
    spread_m: float  # usual distance of the points from their middle

    @property
    def mirrored(self) -> bool:
        """Whether no rotation brings the points together, but their mirror image fits.

        No instrument is left-handed: joints count the other way, or columns are negated or exchanged.
        """
        gross = self.rms_m > GROSS * self.spread_m
        return self.determinant < 0.0 and gross and self.mirrored_rms_m < CLEARLY * self.rms_m


def align(points_a_m: Floats, points_b_m: Floats) -> Alignment:
    """The motion with the least sum of squares, shots far off left out. Both (point, 3).

    DataError for fewer than 3 points, or points on a line, which leave a turn about it open.
    """
    used = np.ones(len(points_a_m), dtype=bool)
    for _ in range(ROUNDS):
        T_a_b = _determined_motion(points_a_m[used], points_b_m[used])
        off_m = np.linalg.norm(_difference(T_a_b, points_a_m, points_b_m), axis=1)
        near = off_m <= FAR * np.median(off_m) + np.finfo(float).eps * np.abs(points_a_m).max()
        if np.array_equal(near, used):
            break
        used = near
    return _judged(points_a_m[used], points_b_m[used], used)


def align_with_tool(T_base_flange: Floats, points_device_m: Floats) -> tuple[Alignment, Floats]:
    """Device frame in the base and target in the flange (3,), neither known, from flange poses (pose, 4, 4).

    R t + p = A y + o is linear in t, A, o; A is then brought to a rotation and t, o are found again. Where all flange
    orientations are alike, t and o cannot be separated and the smallest t is taken. DataError for fewer than 5 poses.
    """
    n = len(points_device_m)
    if n < 5:
        raise DataError(f"tool point and device frame: {n} positions, 15 unknowns need at least 5; give tool.point_m")
    R, p = T_base_flange[:, :3, :3], T_base_flange[:, :3, 3]
    unit = np.broadcast_to(np.eye(3), (n, 3, 3))
    affine = np.einsum("ij,nk->nijk", np.eye(3), points_device_m).reshape(n, 3, 9)
    rows = np.concatenate([-R, affine, unit], axis=2).reshape(-1, 15)
    found = np.linalg.lstsq(rows, p.ravel(), rcond=1e-9)[0]
    turn = nearest_rotation(np.asarray(found[3:12].reshape(3, 3), dtype=np.float64))
    rows = np.concatenate([-R, unit], axis=2).reshape(-1, 6)
    both = np.linalg.lstsq(rows, (p - points_device_m @ turn.T).ravel(), rcond=1e-9)[0]
    tool_m = np.asarray(both[:3], dtype=np.float64)
    return align(R @ tool_m + p, points_device_m), tool_m


def pivot(T_base_flange: Floats, seat: NDArray[np.int64]) -> tuple[Floats, dict[int, Floats]]:
    """Probe tip in the flange (3,) and seats in the base from flange poses (pose, 4, 4): R t + p = s, linear in t, s.

    DataError where the orientations are too alike to separate tip and seats.
    """
    seats = sorted(set(seat.tolist()))
    n = len(seat)
    at = np.zeros((n, 3, len(seats), 3))
    for axis in range(3):
        at[range(n), axis, np.searchsorted(seats, seat), axis] = -1.0
    rows = np.concatenate([T_base_flange[:, :3, :3], at.reshape(n, 3, -1)], axis=2).reshape(3 * n, -1)
    solution, _, rank, _ = np.linalg.lstsq(rows, -T_base_flange[:, :3, 3].ravel(), rcond=1e-6)
    found = np.asarray(solution, dtype=np.float64)
    if rank < rows.shape[1]:
        raise DataError("seats: the probe leans the same way in all rows; its tip is not determined: give tool.point_m")
    return found[:3], {k: found[3 + 3 * i : 6 + 3 * i] for i, k in enumerate(seats)}


def trilaterate(points_m: Floats, lengths_m: Floats) -> Floats:
    """(3,) the point at these distances (point,) from points (point, 3): |p - o|^2 = l^2 less its mean is linear in o.

    DataError for fewer than 4 points, or points in a plane, which leave two answers.
    """
    p = points_m - points_m.mean(axis=0)
    extent = np.linalg.svd(p, compute_uv=False) if len(p) else np.zeros(3)
    if len(p) < 4 or extent[2] < FLAT * extent[0]:
        raise DataError(f"wire: {len(p)} targets in one plane; the drum may be on either side: give [device] or spread")
    square = np.sum(p**2, axis=1) - lengths_m**2
    origin = np.linalg.lstsq(2.0 * p, square - square.mean(), rcond=None)[0]
    return np.asarray(origin + points_m.mean(axis=0), dtype=np.float64)


def _determined_motion(a: Floats, b: Floats) -> Floats:
    """As `rigid_motion`; DataError for fewer than 3 points or points on a line."""
    centred = b - b.mean(axis=0) if len(b) else b
    extent = np.linalg.svd(centred, compute_uv=False) if len(b) >= 3 else np.zeros(3)
    if len(b) < 3 or extent[1] < FLAT * max(extent[0], 1e-300):
        raise DataError(f"device frame: {len(b)} positions on one line or fewer than 3; measure all over the workspace")
    return rigid_motion(a, b)


def _judged(a: Floats, b: Floats, used: Bools) -> Alignment:
    T_a_b, T_mirrored = _determined_motion(a, b), rigid_motion(a, b, mirrored=True)
    U, s, Vt = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
    determinant = float(np.sign(np.linalg.det(U @ Vt))) if s[2] > FLAT**2 * s[0] else 0.0
    spread_m = float(np.median(np.linalg.norm(b - b.mean(axis=0), axis=1)))
    return Alignment(T_a_b, _rms(T_a_b, a, b), _rms(T_mirrored, a, b), determinant, used, spread_m)


def _rms(T_a_b: Floats, a: Floats, b: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(_difference(T_a_b, a, b) ** 2, axis=1))))


def _difference(T_a_b: Floats, a: Floats, b: Floats) -> Floats:
    return np.asarray(b @ T_a_b[:3, :3].T + T_a_b[:3, 3] - a, dtype=np.float64)
