"""How well a nominal arm explains measured positions, whatever frame and target: fast, robust, mirrors allowed.

The least sum of distances by Gauss-Newton under Weiszfeld's weights: a few outlying rows do not pull.
Source: Weiszfeld's weights for sums of distances as in Lawson, Hanson, Solving Least Squares Problems, 1974, ch. 25
(iteratively reweighted least squares); damping by Levenberg, Quart. Appl. Math. 2, 1944.

Frame by weighted rigid alignment, with a mirror where asked; target as the weighted mean of the measured points in the
flange frame; both in turn. Weights are those of the least sum of distances (Weiszfeld), so that a few outlying rows do
not pull. Of several targets each is a point of its own.

Found so: unbroken blocks of positions that only another device frame explains: rows of another session, or a pushed
device.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.samples import POSITION
from calibrate.model.alignment import rigid_motion, weighted_mean
from calibrate.model.checks.gross_error import (
    GrossError,
    GrossErrorKind,
    Shots,
    err_alike,
    outlying,
    postures,
    robust_scale,
    runs_of,
)

Floats = NDArray[np.float64]
TURNS = 25  # compared are factors, not digits
FLOOR = 0.05  # of the median distance: closer rows all weigh the same
DAMPING = 1e-6  # of the mean square of a column: a direction that nothing shows stays where it started
Bools = NDArray[np.bool_]
Rows = NDArray[np.intp]
FEWEST_POSES = 30  # a frame of most rows and one of a block must both stand out
FEWEST_ROWS = 5  # a frame has six unknowns, five positions fifteen numbers
BRIDGE = 2  # honest-looking rows inside a block: points near the axis of the difference
REMAINS = 0.2  # share of the distance that may remain under a frame of the block's own
SHARED = 0.5  # of a block's rows whose neighbours in posture outside err alike: it is the arm's
USUAL = 10.0  # robust sigmas; a block of the same arm seen from another frame comes down to the same misfit


def least_distance(rows: Callable[[Floats], tuple[Floats, Floats]], start: Floats) -> tuple[Floats, Floats]:
    """(unknowns (..., n), distance (..., row)) where `rows` gives residual (..., row) and slope (..., row, n) at them.

    Cases before the last axes of `start` (..., n) are solved side by side, each for itself.
    """
    x, at = start, start
    best = np.full((*start.shape[:-1], 1), np.inf)
    for _ in range(TURNS):
        residual, slope = rows(x)
        distance = np.abs(residual)
        better = np.sum(distance, axis=-1, keepdims=True) < np.sum(best, axis=-1, keepdims=True)
        best, at = np.where(better, distance, best), np.where(better, x, at)
        weighed = np.swapaxes(weights(distance)[..., None] * slope, -1, -2)
        normal = damped(weighed @ slope, DAMPING)
        x = x - np.linalg.solve(normal, weighed @ residual[..., None])[..., 0]
    return at, best


def weights(distance: Floats) -> Floats:
    """(..., row) one over distances (..., row), the floor by the median of each row of them."""
    return np.asarray(1.0 / np.maximum(distance, FLOOR * median(distance)[..., None] + 1e-12))


def median(distance: Floats) -> Floats:
    """(...) of distances (..., row); numpy's own costs ten times as much on so few."""
    ordered, n = np.sort(distance, axis=-1), distance.shape[-1]
    return 0.5 * (ordered[..., (n - 1) // 2] + ordered[..., n // 2])


def damped(normal: Floats, damping: float) -> Floats:
    """Normal matrices (..., n, n) with `damping` times the mean square of their columns added to the diagonals."""
    n = normal.shape[-1]
    mean = np.trace(normal, axis1=-2, axis2=-1) / n + 1e-300
    return np.asarray(normal + damping * mean[..., None, None] * np.eye(n))


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


def rows_of_another_session(shots: Shots) -> tuple[GrossError, ...]:
    """One gross error a block. `shots` are positions (k = 3) after a fit that such blocks could not pull."""
    misfit = shots.misfit()
    distance = np.linalg.norm(misfit, axis=1)
    k = misfit.shape[1]
    scale, odd = robust_scale(distance, k, shots.met), outlying(distance, k, shots.met)
    found = (_block(shots, first, last, misfit, scale) for first, last in _blocks(odd))
    return tuple(gross_error for gross_error in found if gross_error is not None)


def sessions_apart(
    T_base_flange: Floats, position_m: Floats, point_m: Floats | None, rows: Rows
) -> tuple[GrossError, ...]:
    """The same before any fit, by the nominal arm: blocks whose frame is so far off that no fit may see them.

    `T_base_flange` (pose, 4, 4) nominal, positions (pose, 3) of these rows of the samples, `point_m` the target.
    """
    if len(rows) < FEWEST_POSES:
        return ()
    found = rough_fit(T_base_flange, position_m, np.zeros(3) if point_m is None else point_m)
    tips = T_base_flange[:, :3, :3] @ found.point_m + T_base_flange[:, :3, 3]
    expected = tips @ found.linear.T + found.shift_m
    sigma = np.full(3, max(found.typical_m, 1e-9))
    nothing = np.zeros((len(rows), 0))
    reach_m = max(float(np.ptp(tips, axis=0).max()), 1e-9)
    posture = np.concatenate([T_base_flange[:, :3, :3].reshape(-1, 9), tips / reach_m], axis=1)
    shots = Shots(rows, POSITION, nothing, position_m, sigma, lambda which, _q: expected[which], posture)
    return rows_of_another_session(shots)


def _blocks(outlying_rows: Bools) -> list[tuple[int, int]]:
    """Runs of outlying rows, small gaps bridged, long enough for a frame of their own."""
    joined: list[tuple[int, int]] = []
    for first, last in runs_of(np.flatnonzero(outlying_rows).tolist()):
        if joined and first - joined[-1][1] <= BRIDGE + 1:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return [(first, last) for first, last in joined if last - first + 1 >= FEWEST_ROWS]


def _of_the_arm(shots: Shots, block: Rows, misfit: Floats) -> bool:
    """Whether rows outside the block err alike at the same postures."""
    posture = postures(shots.q_rad) if shots.posture is None else shots.posture
    outside = ~np.isin(np.arange(len(misfit)), block)
    return int(outside.sum()) >= FEWEST_ROWS and float(np.mean(err_alike(misfit, posture, block, outside))) > SHARED


def _block(shots: Shots, first: int, last: int, misfit: Floats, scale: float) -> GrossError | None:
    """The block as another frame, None if a frame of its own does not explain it."""
    inside = slice(first, last + 1)
    if _of_the_arm(shots, np.arange(first, last + 1), misfit):
        return None
    observed = shots.observed[inside]
    expected = observed + misfit[inside] * shots.sigma
    T_observed_expected = rigid_motion(observed, expected)
    linear, shift_m = T_observed_expected[:3, :3], T_observed_expected[:3, 3]
    left = np.linalg.norm((expected @ linear.T + shift_m - observed) / shots.sigma, axis=1)
    before = float(np.median(np.linalg.norm(misfit[inside], axis=1)))
    if float(np.median(left)) > max(REMAINS * before, USUAL * scale) or float(np.median(left)) > 0.5 * before:
        return None
    middle = expected.mean(axis=0)
    moved_mm = 1e3 * float(np.linalg.norm(linear @ middle + shift_m - middle))
    turned_mrad = 1e3 * float(Rotation.from_matrix(linear).magnitude())
    what = (
        f"positions in another device frame, {moved_mm:.3g} mm and {turned_mrad:.3g} mrad from the other rows': "
        "rows of another session, or the device was moved"
    )
    rows = tuple(int(r) for r in shots.rows[inside])
    return GrossError(
        GrossErrorKind.OTHER_SESSION, rows, ", ".join(shots.columns), what, "identify them as a file of their own"
    )
