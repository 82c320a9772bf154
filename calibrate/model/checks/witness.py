"""What an instrument shows of whether the nominal arm can have moved as the file states: its strain, in metres.

A witness fits, robustly and in milliseconds, whatever nobody states exactly (the device's frame, the target, the cones)
and returns what distance remains. Files by another convention are found by comparing strains, never by a threshold.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import TARGET
from calibrate.model.checks.gross_error import GrossErrorKind

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

ENOUGH_POSES = 150  # more do not change which hypothesis wins
TRUST = 0.1  # of what is drawn: a target may be 10 mm off where the readings are explained to 1 mm


@dataclass(frozen=True)
class Strain:
    """Median distance between arm and readings, and by how much drawn things had to move for it; both in m.

    Of many cases side by side these are (case,).
    """

    typical_m: Floats
    moved_m: Floats

    def __add__(self, other: "Strain") -> "Strain":
        """Of two instruments together."""
        return Strain(self.typical_m + other.typical_m, self.moved_m + other.moved_m)

    def of_case(self, case: int) -> "Strain":
        """Of one case of many."""
        return Strain(self.typical_m[case], self.moved_m[case])

    @property
    def compared_m(self) -> Floats:
        """What the better of two explanations has less of."""
        return self.typical_m + TRUST * self.moved_m


class Witness(Protocol):
    """One instrument's readings beside the joint angles of the same rows."""

    @property
    def q_rad(self) -> Floats:
        """(pose, joint) as written, of the poses that `strain` wants."""
        ...

    def strain(self, T_base_flange: Floats) -> Strain:
        """For flange poses (..., pose, 4, 4) of the nominal arm: one case, or many side by side, each for itself."""
        ...

    def otherwise(self) -> "Iterator[Otherwise]":
        """The same readings as they would be if the file wrote them by another known convention."""
        ...


@dataclass(frozen=True)
class Otherwise:
    """Another convention of an instrument's columns, and its readings then."""

    kind: GrossErrorKind
    column: str
    what: str
    remedy: str
    witness: Witness


def thinned(rows: Rows, most: int = ENOUGH_POSES) -> Rows:
    """No more than so many of these rows, evenly spread."""
    return np.unique(rows[np.linspace(0, len(rows) - 1, most).astype(np.intp)]) if len(rows) else rows


def filled(samples: Samples, *names: str) -> Rows:
    """Rows in which all of these columns hold a value; none where a column is absent."""
    if not all(name in samples for name in names):
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero(np.all(np.isfinite(stacked(samples, names)), axis=1))


def stacked(samples: Samples, names: tuple[str, ...]) -> Floats:
    """(row, column)"""
    return np.stack([samples.column(name) for name in names], axis=1)


def by_target(rig: Rig, samples: Samples, rows: Rows) -> tuple[tuple[Rows, Floats | None], ...]:
    """These rows target by target, each with its point (3,) nominal, in the flange frame; None: not stated."""
    named = samples.integers(TARGET, 0)[rows]
    if not rig.targets:
        return ((rows, drawn_point_m(rig)),)
    points = {0: drawn_point_m(rig)} | {k: np.array(target.point_m) for k, target in rig.targets.items()}
    return tuple((rows[named == k], points.get(k)) for k in sorted(set(named.tolist())))


def drawn_point_m(rig: Rig) -> Floats | None:
    """(3,) target at its nominal place in the flange frame."""
    return None if rig.tool.point_m is None else np.array(rig.tool.point_m)
