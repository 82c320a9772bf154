"""Single rows that no noise explains, and the one cell that would explain each of them: a typed digit, a bad shot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.checks.gross_error import Blunder, BlunderKind
from calibrate.model.checks.same_posture import err_alike, postures
from calibrate.model.checks.shots import Shots, outlying, robust_scale

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

EXPLAINED = 4.0  # robust sigmas that may be left of a row once the guilty cell is changed
CLEARER = 3.0  # times less must be left than with the next best cell, else no cell is named
GRID_RAD = np.linspace(-np.pi, np.pi, 181)  # starts of the search for the angle that was meant
NEWTON_STEPS = 8
DIFFERENCE_RAD = 1e-6


@dataclass(frozen=True)
class _Suspect:
    """A cell, what it would have to hold, and what is left of the misfit (in assumed sigmas) then."""

    column: str
    written: float
    meant: float
    unit: str
    left: float


def bad_rows(shots: Shots, among: Indices | None = None) -> tuple[Blunder, ...]:
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


def _named(shots: Shots, i: int, misfit: Floats, scale: float) -> Blunder:
    rows = (int(shots.rows[i]),)
    suspects = sorted([*_readings(shots, i, misfit), *_angles(shots, i)], key=lambda s: s.left)
    best = suspects[0]
    alone = len(suspects) == 1 or suspects[1].left > CLEARER * max(best.left, scale)
    if len(misfit) > 1 and best.left < EXPLAINED * scale and alone:
        what = f"reads {best.written:.9g} where the other rows give about {best.meant:.6g} {best.unit}"
        return Blunder(BlunderKind.WRONG_VALUE, rows, best.column, what, "correct the cell, or remove the row")
    away = float(np.linalg.norm(misfit * shots.sigma))
    unit = "mrad" if _unit(shots.columns[0]) == "rad" else "mm"
    what = f"{1e3 * away:.3g} {unit} away from what all other rows predict ({np.linalg.norm(misfit) / scale:.0f} sigma)"
    return Blunder(BlunderKind.BAD_SHOT, rows, ", ".join(shots.columns), what, "measure it again, or remove the row")


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
        here, beside = misfit(np.array([turn, turn + DIFFERENCE_RAD]))
        slope = (beside - here) / DIFFERENCE_RAD
        square = float(slope @ slope)
        if square == 0.0:
            break
        turn -= float(slope @ here) / square
    return turn, float(np.linalg.norm(misfit(np.array([turn]))[0]))
