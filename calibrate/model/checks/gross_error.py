"""A gross error (which rows, which column, what is wrong, what to do), and what the search for such rows works on.

The search sees rows of one instrument: what was read, what the fitted arm expects. Before a row is called a fault, its
neighbours in posture are compared: where those taken at other times err alike, it is the arm. A wrong digit, a bad shot
or another session has nothing to do with where the arm stood. An error of the arm comes back whenever the arm comes
back to that posture.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Bools = NDArray[np.bool_]
LIMIT = 10.0  # robust sigmas: the farthest of 6000 rows of four real robots lies at 9, from physics no model had
LEAST_SCALE = 0.1  # of the assumed noise: perfect data make no row suspicious
NEIGHBOURS = 3  # nearest in posture, of those taken at other times; more than half have to err alike
AS_NEAR = 2.0  # times the distance of the nearest: farther ones show nothing
MORE_THAN = 0.5
APART = 5  # rows in the order of capture: nearer ones may share a fault
SIZE = (0.4, 2.5)  # of an error alike, over the row's own
COSINE = 0.8  # between both errors


class GrossErrorKind(Enum):
    """Faults of a file, not of an arm; the value is the short name for a person."""

    DEGREES = "joint angles in degrees"
    JOINT_SIGN = "joint counted the other way round"
    JOINT_OFFSET = "joint zero off by a quarter turn or more"
    JOINT_COUPLING = "joint angle counted from another link"
    TABLE_CONVENTION = "table of the arm by another convention"
    ANOTHER_ARM = "no arm of this table"
    MIRRORED_AXIS = "mirrored axis"
    MILLIMETRES = "lengths in millimetres"
    INVERTED_ROTATION = "orientation the other way round"
    EXCHANGED_PSD = "detectors exchanged"
    BEYOND_LIMITS = "joint angle beyond its limits"
    DUPLICATED_ROWS = "duplicated rows"
    LEFT_ALONE = "row without its partner"
    WRONG_DISTANCE = "known distance that the readings contradict"
    OTHER_SESSION = "rows of another session"
    WRONG_VALUE = "wrong value"
    BAD_SHOT = "bad shot"


@dataclass(frozen=True)
class GrossError:
    """One named fault. `rows` count from 0; empty: the whole file is affected and there is nothing to fit."""

    kind: GrossErrorKind
    rows: tuple[int, ...]
    column: str
    what: str
    remedy: str

    @property
    def whole_file(self) -> bool:
        return not self.rows

    @property
    def says(self) -> str:
        """One sentence; rows are counted from 1 below the header, as in every message about samples."""
        where = "all rows" if self.whole_file else rows_in_words(self.rows)
        return f"{where}, {self.column}: {self.what}; {self.remedy}"


def rows_in_words(rows: Sequence[int]) -> str:
    """Rows from 0 for a person, who counts from 1.

    >>> rows_in_words([4, 5, 6, 9])
    'rows 5-7, 10'
    """
    runs = runs_of(rows)
    text = ", ".join(str(first + 1) if first == last else f"{first + 1}-{last + 1}" for first, last in runs)
    return f"row {text}" if len(rows) == 1 else f"rows {text}"


def runs_of(rows: Sequence[int]) -> list[tuple[int, int]]:
    """Unbroken runs (first, last) of sorted row numbers."""
    runs: list[tuple[int, int]] = []
    for row in rows:
        if runs and row == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], row)
        else:
            runs.append((row, row))
    return runs


@dataclass(frozen=True)
class Shots:
    """Observations (obs, k) with their columns; `expect` predicts them for other joint angles at the same shots."""

    rows: Rows  # (obs,) in the samples, from 0
    columns: tuple[str, ...]  # (k,)
    q_rad: Floats  # (obs, joint)
    observed: Floats  # (obs, k)
    sigma: Floats  # (k,) assumed, in the unit of the columns
    expect: Callable[[Rows, Floats], Floats]  # which of the obs, their angles (m, joint) -> (m, k)
    posture: Floats | None = None  # (obs, n) between which distances are those of postures; None: by the angles
    met: int = 0  # rows that the fit can meet exactly: they show nothing about what distance is usual

    def misfit(self) -> Floats:
        """(obs, k) expected minus observed over assumed sigma."""
        every = np.arange(len(self.rows))
        return (self.expect(every, self.q_rad) - self.observed) / self.sigma


def robust_scale(distance: Floats, k: int, met: int = 0) -> float:
    """One sigma of a coordinate from the median of distances (obs,) over k coordinates (Hampel's MAD, for chi).

    `met`: so many of the nearest rows are not counted.
    """
    middle = float(np.median(np.sort(distance)[met:]))
    return max(middle / float(np.sqrt(chdtri(k, 0.5))), LEAST_SCALE)


def outlying(distance: Floats, k: int, met: int = 0) -> Bools:
    """(obs,) rows whose distance over k coordinates no noise of these data reaches."""
    return distance > LIMIT * robust_scale(distance, k, met)


def postures(q_rad: Floats) -> Floats:
    """(row, 2 joint) between which distances are those of postures, whole turns apart or not."""
    return np.concatenate([np.cos(q_rad), np.sin(q_rad)], axis=1)


def err_alike(misfit: Floats, posture: Floats, among: Rows, allowed: Bools | None = None) -> Bools:
    """(among,) whether the nearest neighbours in posture err as each of these rows does.

    `misfit` (row, k), `posture` (row, n), rows in the order of capture; `allowed` (row,) which may be neighbours, all
    if None.
    """
    out = np.zeros(len(among), dtype=bool)
    others = np.arange(len(misfit)) if allowed is None else np.flatnonzero(allowed)
    for at, row in enumerate(among.tolist()):
        free = others[np.abs(others - row) > APART]
        if len(free) == 0:
            continue
        away = np.linalg.norm(posture[free] - posture[row], axis=1)
        near = np.argsort(away, kind="stable")[:NEIGHBOURS]
        near = free[near[away[near] <= AS_NEAR * away[near[0]]]]
        own, there = float(np.linalg.norm(misfit[row])), np.linalg.norm(misfit[near], axis=1)
        along = misfit[near] @ misfit[row] / np.maximum(there * own, 1e-300)
        alike = (along > COSINE) & (there > SIZE[0] * own) & (there < SIZE[1] * own)
        out[at] = bool(np.mean(alike) > MORE_THAN)
    return out
