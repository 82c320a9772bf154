"""Rows with gross errors, by their misfit and by the table alone.

By misfit: single rows that no noise explains, and the one cell that would explain each of them: a typed digit, a bad
shot.

By the table, without any instrument: angles beyond the range of the rig, copies, rows left without their pair.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import BAR, BAR_END, SEAT, Kind, kind_of
from calibrate.model.checks.gross_error import (
    GrossError,
    GrossErrorKind,
    Shots,
    err_alike,
    outlying,
    postures,
    robust_scale,
    rows_in_words,
)

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
EXPLAINED = 4.0  # robust sigmas that may be left of a row once the guilty cell is changed
CLEARER = 3.0  # times less must be left than with the next best cell, else no cell is named
GRID_RAD = np.linspace(-np.pi, np.pi, 181)  # starts of the search for the angle that was meant
NEWTON_STEPS = 8
DIFFERENCE_RAD = 1e-6
SLACK_RAD = (
    0.1  # a zero may be 4.5 deg off (calibrate/model/arms/link_tolerance.py), and ranges are stated in round numbers
)
SHARE = 0.1  # of the rows: beyond, it is the stated range that is in question and the instruments decide


@dataclass(frozen=True)
class _Suspect:
    """A cell, what it would have to hold, and what is left of the misfit (in assumed sigmas) then."""

    column: str
    written: float
    meant: float
    unit: str
    left: float


def bad_rows(shots: Shots, among: Indices | None = None) -> tuple[GrossError, ...]:
    """One gross error a row, of those `among` the observations. Nothing where they are too few to show what is usual.

    Rows whose neighbours in posture err alike are the arm's.
    """
    misfit = shots.misfit()
    k = misfit.shape[1]
    distance = np.linalg.norm(misfit, axis=1)
    scale = robust_scale(distance, k, shots.met)
    found = np.flatnonzero(outlying(distance, k, shots.met))
    found = found if among is None else np.intersect1d(found, among)
    found = found[~err_alike(misfit, postures(shots.q_rad), found)]
    return tuple(_named(shots, int(i), misfit[i], scale) for i in found)


def _named(shots: Shots, i: int, misfit: Floats, scale: float) -> GrossError:
    rows = (int(shots.rows[i]),)
    suspects = sorted([*_readings(shots, i, misfit), *_angles(shots, i)], key=lambda s: s.left)
    best = suspects[0]
    alone = len(suspects) == 1 or suspects[1].left > CLEARER * max(best.left, scale)
    if len(misfit) > 1 and best.left < EXPLAINED * scale and alone:
        what = f"reads {best.written:.9g} where the other rows give about {best.meant:.6g} {best.unit}"
        return GrossError(GrossErrorKind.WRONG_VALUE, rows, best.column, what, "correct the cell, or remove the row")
    away = float(np.linalg.norm(misfit * shots.sigma))
    unit = "mrad" if _unit(shots.columns[0]) == "rad" else "mm"
    what = f"{1e3 * away:.3g} {unit} away from what all other rows predict ({np.linalg.norm(misfit) / scale:.0f} sigma)"
    return GrossError(
        GrossErrorKind.BAD_SHOT, rows, ", ".join(shots.columns), what, "measure it again, or remove the row"
    )


def _readings(shots: Shots, i: int, misfit: Floats) -> list[_Suspect]:
    """Each reading alone: its misfit is then nought, the others stay."""
    written = shots.observed[i]
    meant = written + misfit * shots.sigma
    return [
        _Suspect(column, float(written[c]), float(meant[c]), _unit(column), float(np.linalg.norm(np.delete(misfit, c))))
        for c, column in enumerate(shots.columns)
    ]


def _unit(column: str) -> str:
    """Of a reading, by the name of its column."""
    return "rad" if column.endswith("_rad") else "m"


def _angles(shots: Shots, i: int) -> list[_Suspect]:
    """Each joint alone, turned to where it leaves the least: a grid, then Gauss-Newton on the one angle."""
    out: list[_Suspect] = []
    for j in range(shots.q_rad.shape[1]):
        step, left = _best_turn(shots, i, j)
        written = float(shots.q_rad[i, j])
        meant = written + step
        if abs(meant) > 2.0 * np.pi:  # no arm turns so far: what is written is whole turns off as well
            meant = float(np.remainder(meant + np.pi, 2.0 * np.pi) - np.pi)
        out.append(_Suspect(f"q{j + 1}_rad", written, meant, "rad", left))
    return out


def _best_turn(shots: Shots, i: int, j: int) -> tuple[float, float]:
    """(turn in rad, misfit left) of joint j at shot i."""

    def misfit(turns: Floats) -> Floats:
        q = np.repeat(shots.q_rad[i : i + 1], len(turns), axis=0)
        q[:, j] += turns
        return (shots.expect(np.full(len(turns), i, dtype=np.intp), q) - shots.observed[i]) / shots.sigma

    starts = np.append(GRID_RAD, 0.0)
    turn = float(starts[np.argmin(np.linalg.norm(misfit(starts), axis=1))])
    for _ in range(NEWTON_STEPS):
        here, moved = misfit(np.array([turn, turn + DIFFERENCE_RAD]))
        slope = (moved - here) / DIFFERENCE_RAD
        square = float(slope @ slope)
        if square == 0.0:
            break
        turn -= float(slope @ here) / square
    return turn, float(np.linalg.norm(misfit(np.array([turn]))[0]))


def rows_beyond_limits(samples: Samples, limits_rad: Floats) -> tuple[GrossError, ...]:
    """One gross error a row whose angles leave their range (joint, 2)."""
    q_rad = samples.joints()
    beyond = (q_rad < limits_rad[:, 0] - SLACK_RAD) | (q_rad > limits_rad[:, 1] + SLACK_RAD)
    rows = np.flatnonzero(beyond.any(axis=1))
    if len(rows) > SHARE * len(q_rad):
        return ()
    return tuple(_beyond(row, beyond[row], q_rad[row], limits_rad) for row in rows.tolist())


def _beyond(row: int, beyond: NDArray[np.bool_], q_rad: Floats, limits_rad: Floats) -> GrossError:
    joints = np.flatnonzero(beyond).tolist()
    values = ", ".join(f"{q_rad[j]:g} rad is not within {limits_rad[j, 0]:g} to {limits_rad[j, 1]:g}" for j in joints)
    columns = ", ".join(f"q{j + 1}_rad" for j in joints)
    return GrossError(
        GrossErrorKind.BEYOND_LIMITS, (row,), columns, values, "correct the cell, or the range in the rig"
    )


READINGS = ("psd1_x_m", "x_m", "wire_m")  # columns of instruments whose noise never repeats to the last digit


def duplicated_rows(samples: Samples) -> tuple[GrossError, ...]:
    """One gross error per row that repeats an earlier one in every column; its `rows` are the copies only.

    The time may differ where an instrument's reading is in the row, since two shots never agree to the last digit;
    a seat row has no reading but the joints, whose counts can repeat, so there the time must be the same too.
    """
    keys = _keys(samples)
    first: dict[tuple[object, ...], int] = {}
    copies: dict[int, list[int]] = {}
    for row, key in enumerate(keys):
        original = first.setdefault(key, row)
        if original != row:
            copies.setdefault(original, []).append(row)
    return tuple(_copies(original, rows) for original, rows in copies.items())


def _keys(samples: Samples) -> list[tuple[object, ...]]:
    numbers = [n for n in samples.names if kind_of(n) is not Kind.TEXT and n != "t_s"]
    values = np.stack([np.nan_to_num(samples.column(n), nan=-1e300) for n in numbers], axis=1)
    read = np.zeros(len(samples), dtype=bool)
    for name in READINGS:
        if name in samples:
            read |= np.isfinite(samples.column(name))
    ends = samples.columns.get("bar_end", np.full(len(samples), ""))
    times = samples.column("t_s")
    return [
        (row.tobytes(), str(end), None if seen else float(t))
        for row, end, seen, t in zip(values, ends, read, times, strict=True)
    ]


def _copies(original: int, rows: list[int]) -> GrossError:
    what = f"a copy of {rows_in_words([original])}, equal in every column"
    return GrossError(GrossErrorKind.DUPLICATED_ROWS, tuple(rows), "every column", what, "remove the copies")


AGAIN = "take both again, or remove it too"


def left_alone(samples: Samples, gross_errors: Sequence[GrossError]) -> tuple[GrossError, ...]:
    """One gross error for every row that has lost its partner to these gross errors, or to one found here."""
    copies = {row for b in gross_errors if b.kind is GrossErrorKind.DUPLICATED_ROWS for row in b.rows}
    bad = {row for b in gross_errors for row in b.rows}
    out: list[GrossError] = []
    while found := [*_ends(samples, copies, bad), *_last_in_seat(samples, bad)]:
        bad |= {row for b in found for row in b.rows}
        out += found
    return tuple(out)


def _ends(samples: Samples, copies: set[int], bad: set[int]) -> Iterator[GrossError]:
    """Consecutive rows that have a bar form a pair (calibrate/model/sensors/bar.py); a copy is none of them."""
    with_bar = [row for row in np.flatnonzero(samples.integers(BAR, -1) >= 0).tolist() if row not in copies]
    for pair in zip(with_bar[::2], with_bar[1::2], strict=False):
        gone = bad.intersection(pair)
        if len(gone) == 1:
            (left,) = set(pair) - gone
            (other,) = gone
            what = f"the other end of this bar, row {other + 1}, is left out"
            yield GrossError(GrossErrorKind.LEFT_ALONE, (left,), BAR_END, what, AGAIN)


def _last_in_seat(samples: Samples, bad: set[int]) -> Iterator[GrossError]:
    """A cone needs two rows to show anything (calibrate/model/sensors/seat.py)."""
    seat = samples.integers(SEAT, -1)
    for k in np.unique(seat[seat >= 0]).tolist():
        rows = set(np.flatnonzero(seat == k).tolist())
        if len(rows - bad) == 1 and len(rows) > 1:
            what = f"the only row of seat {k} when the others are left out"
            yield GrossError(GrossErrorKind.LEFT_ALONE, tuple(rows - bad), SEAT, what, AGAIN)
