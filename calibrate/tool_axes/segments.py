"""Where in a recording only one joint turns: found from the joint readings alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STILL_RAD = 2e-4  # a standing axis scatters by its repeatability, 1e-5 rad class; a deliberate step is far more
FEWEST = 5  # rows: a circle has 6 unknowns and 2 equations a point, which leaves 4 to tell its noise
SHORTEST_RAD = 0.35  # 20 deg of arc: below, centre and radius trade against each other


@dataclass(frozen=True)
class Segment:
    """Consecutive rows over which one joint turns and all others stand."""

    joint: int  # counted from 1
    rows: NDArray[np.intp]

    def held(self, q_rad: Floats) -> Floats:
        """(joint,) mean readings over the segment."""
        return q_rad[self.rows].mean(axis=0)

    def span_rad(self, q_rad: Floats) -> float:
        """How far the joint turns."""
        return float(np.ptp(q_rad[self.rows, self.joint - 1]))


def single_axis_segments(q_rad: Floats) -> tuple[Segment, ...]:
    """The longest runs of rows (row, joint) in which one joint alone moves, in order; neighbours may share a row."""
    return tuple(run for run in _runs(q_rad) if _usable(run, q_rad))


def too_short(q_rad: Floats) -> tuple[Segment, ...]:
    """Runs in which one joint alone moves, but over too few rows or too short an arc for a circle."""
    return tuple(run for run in _runs(q_rad) if not _usable(run, q_rad))


def _usable(run: Segment, q_rad: Floats) -> bool:
    return len(run.rows) >= FEWEST and run.span_rad(q_rad) >= SHORTEST_RAD


def _runs(q_rad: Floats) -> tuple[Segment, ...]:
    """Every run of at least three rows in which one joint moves, the longest at each place."""
    found: list[Segment] = []
    first = 0
    while first < len(q_rad) - 1:
        best = max((_run(q_rad, first, joint) for joint in range(q_rad.shape[1])), key=lambda run: len(run.rows))
        if len(best.rows) > 2 and best.span_rad(q_rad) > STILL_RAD:
            found.append(best)
            first = int(best.rows[-1])
        else:
            first += 1
    return tuple(found)


def _run(q_rad: Floats, first: int, joint: int) -> Segment:
    others = np.delete(q_rad[first:] - q_rad[first], joint, axis=1)
    moved = np.any(np.abs(others) > STILL_RAD, axis=1)
    end = first + int(np.argmax(moved)) if moved.any() else len(q_rad)
    return Segment(joint + 1, np.arange(first, end))
