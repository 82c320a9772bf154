"""Gross errors before physics: what is wrong with the file, and which rows have no part in the diagnosis.

Other than before an identification, what moved or drifted stays in: it is the very thing that is sought. Only where
something stands farther off than any bump moves it (model/effects/moved.py), rows are those of another session.

Rows of an instrument that stand apart from all others, and whether that is a gross error or physics.

A wrong digit stands alone and far off, with nothing between it and the rest; physics makes residuals of all sizes, or
moves rows that follow one another. So only few, single rows behind a gap are gross errors before physics is sought.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import POSITION, SEAT
from calibrate.diagnose import limits
from calibrate.diagnose.state.session import Session, session_of
from calibrate.fit.gross_errors import bad_rows
from calibrate.fit.identify.clean import refuse_most, rows_of
from calibrate.fit.identify.identify import impossible_rows
from calibrate.fit.identify.rounds import distances, wary_fit
from calibrate.fit.identify.session import columns_of, shots_of
from calibrate.fit.identify.wrong_file import wrong_file
from calibrate.model.alignment import rigid_motion
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.checks.gross_error import (
    LIMIT,
    GrossError,
    GrossErrorKind,
    Shots,
    err_alike,
    outlying,
    postures,
    robust_scale,
    runs_of,
)
from calibrate.model.checks.rough_fit import rough_fit, sessions_apart
from calibrate.model.checks.witness import by_target
from calibrate.model.effects.moved import LIMIT as MOVED_LIMIT
from calibrate.model.parameters import start_values
from calibrate.model.problem import Measured
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]


def alone(distance: Floats, k: int, place: Ints) -> Ints:
    """Observations to leave out before physics is sought.

    `distance` (obs,) whitened misfit over k coordinates in the order they were taken; `place` (obs,) where the fixture
    or the probe stood, -1 where that is no question.
    """
    apart = behind_gap(distance, k)
    if not 0 < int(apart.sum()) <= max(limits.OUTLYING_COUNT, limits.OUTLYING_SHARE * len(distance)):
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero(apart & ~lasting(apart, place))


def behind_gap(distance: Floats, k: int) -> Bools:
    """(obs,) farther than any noise, and with a gap to all that are nearer."""
    order = np.argsort(distance)
    size = np.maximum(distance[order], robust_scale(distance, k))
    after_gap = (size[1:] > limits.GAP * size[:-1]) & (size[1:] > LIMIT * robust_scale(distance, k))
    out = np.zeros(len(distance), dtype=bool)
    if len(distance) >= limits.FEWEST_OF_INSTRUMENT and after_gap.any():
        out[order[int(np.argmax(after_gap)) + 1 :]] = True
    return out


def lasting(apart: Bools, place: Ints) -> Bools:
    """(obs,) of those apart the ones that follow one another, among all rows or among those of one place."""
    out = _in_runs(apart)
    for one in np.unique(place):
        mine = np.flatnonzero(place == one)
        out[mine] |= _in_runs(apart[mine])
    return out


def unexplained_rows(whitened: Floats) -> Ints:
    """Observations (obs, k) that no model explains; none where they are so many that it is the model which is wrong."""
    distance = np.linalg.norm(whitened, axis=1)
    bad = np.flatnonzero(outlying(distance, whitened.shape[1]))
    return (
        bad
        if len(bad) <= max(limits.OUTLYING_COUNT, limits.OUTLYING_SHARE * len(distance))
        else np.zeros(0, dtype=np.intp)
    )


def _in_runs(apart: Bools) -> Bools:
    out = np.zeros(len(apart), dtype=bool)
    for first, last in runs_of(np.flatnonzero(apart).tolist()):
        if last - first + 1 >= limits.OUTLYING_RUN:
            out[first : last + 1] = True
    return out


PLACES = ("placement", SEAT)


@dataclass(frozen=True)
class Cleared:
    """What may be diagnosed. `rows` (sample,) of the file; empty where the whole file is wrong."""

    samples: Samples
    rows: Ints
    blunders: tuple[GrossError, ...]

    @property
    def whole_file(self) -> bool:
        """Whether there is nothing to diagnose before the file is put right."""
        return any(gross_error.whole_file for gross_error in self.blunders)


def gross_errors_first(rig: Rig, samples: Samples) -> Cleared:
    """DataError where the samples hold no observation, or where so many rows are bad that none can be trusted."""
    if wrong := wrong_file(rig, samples):
        return Cleared(samples, np.zeros(0, dtype=np.intp), wrong)
    gross_errors = [*impossible_rows(rig, samples), *_joined(rig, samples)]
    kept = _kept(samples, gross_errors)
    for _ in range(limits.OUTLYING_PASSES):
        found = [_counted(gross_error, kept) for gross_error in _outlying(session_of(rig, samples.take(kept)))]
        if not found:
            break
        gross_errors += found
        kept = _kept(samples, gross_errors)
    return Cleared(samples.take(kept), kept, tuple(gross_errors))


def place_of(samples: Samples) -> Ints:
    """(sample,) where fixture or probe stood; -1 where neither is recorded."""
    for name in PLACES:
        if name in samples:
            return samples.integers(name, -1).astype(np.intp)
    return np.full(len(samples), -1, dtype=np.intp)


def _kept(samples: Samples, gross_errors: list[GrossError]) -> Ints:
    refuse_most(tuple(gross_errors), len(samples)) if gross_errors else None
    return np.setdiff1d(np.arange(len(samples)), rows_of(gross_errors))


def _counted(gross_error: GrossError, kept: Ints) -> GrossError:
    """Rows of the file instead of rows of what was kept."""
    return replace(gross_error, rows=tuple(int(kept[row]) for row in gross_error.rows))


def _joined(rig: Rig, samples: Samples) -> list[GrossError]:
    """Blocks of positions in a frame so far off that nothing was bumped: another session."""
    if POSITION[0] not in samples:
        return []
    positions = np.stack([samples.column(c) for c in POSITION], axis=1)
    rows = np.flatnonzero(np.isfinite(positions[:, 0]))
    arm = arm_of(rig)
    flange = arm.flange(start_values(arm.parameters), samples.joints()[rows])
    out: list[GrossError] = []
    for theirs, point in by_target(rig, samples, rows):
        out += _joined_among(flange[np.searchsorted(rows, theirs)], positions[theirs], point, theirs)
    return out


def _joined_among(flange: Floats, positions: Floats, point: Floats | None, rows: NDArray[np.intp]) -> list[GrossError]:
    """Of one target: flange poses (row, 4, 4) nominal, positions (row, 3) of these rows, its point (3,)."""
    found = sessions_apart(flange, positions, point, rows)
    if not found:
        return []
    rough = rough_fit(flange, positions, np.zeros(3) if point is None else point)
    tips = flange[:, :3, :3] @ rough.point_m + flange[:, :3, 3]
    expected = tips @ rough.linear.T + rough.shift_m
    return [b for b in found if _moved(expected, positions, np.isin(rows, b.rows))]


def _moved(expected: Floats, observed: Floats, block: NDArray[np.bool_]) -> bool:
    T_observed_expected = rigid_motion(observed[block], expected[block])
    linear, shift_m = T_observed_expected[:3, :3], T_observed_expected[:3, 3]
    middle = expected[block].mean(axis=0)
    moved_m = float(np.linalg.norm(linear @ middle + shift_m - middle))
    return max(moved_m, float(Rotation.from_matrix(linear).magnitude())) > MOVED_LIMIT


def _outlying(session: Session) -> list[GrossError]:
    """Single rows, and blocks farther off than a bump; rows count in the session's samples."""
    theta = wary_fit(session.weighting, session.start)
    problem = session.weighting.problem(theta)
    place = place_of(session.samples)
    out: list[GrossError] = []
    every = zip(session.measured, distances(problem, theta), strict=False)  # known lengths come last and are no rows
    for index, (measured, distance) in enumerate(every):
        if measured.problem.rows < limits.FEWEST_OF_INSTRUMENT or measured.name == ENCODER_DIFFERENCE:
            continue
        k = measured.problem.observed.shape[1]
        own = problem.of_block(index, theta)
        here = place[measured.sample_rows[:, -1]]
        single = alone(distance, k, here)
        away_m = np.linalg.norm(measured.problem.misfit(own)[:, :3], axis=1)
        shots = shots_of(measured, own)
        if shots is None:
            out += [_pair(measured, int(i), float(away_m[i])) for i in single]
            continue
        out += bad_rows(shots, single)
        block = lasting_rows(behind_gap(distance, k), here, shots)
        out += _blocks(measured, block, away_m, _limit_m(session, measured))
    return out


def lasting_rows(apart: NDArray[np.bool_], place: Ints, shots: Shots) -> Ints:
    """Of the rows that are `apart` (row,) those that follow one another, and whose neighbours in posture at other times
    do not err alike.
    """
    block = np.flatnonzero(apart & lasting(apart, place))
    if len(block) == 0:
        return block
    others = ~np.isin(np.arange(len(apart)), block)
    return block[~err_alike(shots.misfit(), postures(shots.q_rad), block, others)]


def _blocks(measured: Measured, block: Ints, away_m: Floats, limit_m: float) -> list[GrossError]:
    """Rows that follow one another, all farther off than a bump moves anything."""
    if len(block) == 0 or float(np.median(away_m[block])) < limit_m:
        return []
    rows = tuple(sorted(int(r) for r in measured.sample_rows[block, -1]))
    what = f"{1e3 * float(np.median(away_m[block])):.3g} mm from where all other rows have it"
    remedy = "another session was joined here, or something was put elsewhere: diagnose them as a file of their own"
    return [GrossError(GrossErrorKind.OTHER_SESSION, rows, ", ".join(columns_of(measured)), what, remedy)]


def _limit_m(session: Session, measured: Measured) -> float:
    """Beyond, no bump has moved a reading."""
    return min(MOVED_LIMIT, kind_of(measured.name).far_m(session.rig))


def _pair(measured: Measured, i: int, away_m: float) -> GrossError:
    """Of a pair of rows it is open which one is wrong."""
    rows = tuple(sorted(int(r) for r in measured.sample_rows[i]))
    what = f"{measured.name} {1e3 * away_m:.3g} mm away from what all other rows predict"
    return GrossError(
        GrossErrorKind.BAD_SHOT, rows, ", ".join(columns_of(measured)), what, "take both again, or remove them"
    )
