"""Unbroken blocks of positions that only another device frame explains: rows of another session, or a pushed device."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.samples import POSITION
from calibrate.model.alignment import rigid_motion
from calibrate.model.checks.gross_error import Blunder, BlunderKind, runs_of
from calibrate.model.checks.rough_fit import rough_fit
from calibrate.model.checks.same_posture import err_alike, postures
from calibrate.model.checks.shots import Shots, outlying, robust_scale

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Rows = NDArray[np.intp]

FEWEST_POSES = 30  # a frame of most rows and one of a block must both stand out

FEWEST_ROWS = 5  # a frame has six unknowns, five positions fifteen numbers
BRIDGE = 2  # honest-looking rows inside a block: points near the axis of the difference
REMAINS = 0.2  # share of the distance that may remain under a frame of the block's own
SHARED = 0.5  # of a block's rows whose neighbours in posture outside err alike: it is the arm's
USUAL = 10.0  # robust sigmas; a block of the same arm seen from another frame comes down to the same misfit


def rows_of_another_session(shots: Shots) -> tuple[Blunder, ...]:
    """One gross error a block. `shots` are positions (k = 3) after a fit that such blocks could not pull."""
    misfit = shots.misfit()
    distance = np.linalg.norm(misfit, axis=1)
    k = misfit.shape[1]
    scale, odd = robust_scale(distance, k, shots.met), outlying(distance, k, shots.met)
    found = (_block(shots, first, last, misfit, scale) for first, last in _blocks(odd))
    return tuple(blunder for blunder in found if blunder is not None)


def sessions_apart(
    T_base_flange: Floats, position_m: Floats, point_m: Floats | None, rows: Rows
) -> tuple[Blunder, ...]:
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


def _block(shots: Shots, first: int, last: int, misfit: Floats, scale: float) -> Blunder | None:
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
    return Blunder(
        BlunderKind.OTHER_SESSION, rows, ", ".join(shots.columns), what, "identify them as a file of their own"
    )
