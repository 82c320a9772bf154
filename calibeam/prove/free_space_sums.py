"""Error in free space against the world's truth, summed up: geometry alone, with what was found, with what is true."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibeam.prove.record import CaseScore

ONES = ("one", "disturbed", "three")
WORTH = 0.9  # of the error: an oracle that leaves more has nothing to share out


@dataclass(frozen=True)
class FreeSpaceLine:
    """Cases of one kind that were compared with the oracle; medians, m."""

    label: str
    cases: int
    geometry_m: float
    found_m: float
    oracle_m: float


def by_instrument(cases: Sequence[CaseScore]) -> list[FreeSpaceLine]:
    """Of cases with hidden causes that a catalogue may list, and all three numbers."""
    compared = [c for c in cases if c.kind in ONES and _numbers(c) is not None]
    words = sorted({c.family for c in compared})
    return [_free_space_line(word, [c for c in compared if c.family == word]) for word in words]


def shares_of_oracle(cases: Sequence[CaseScore]) -> list[float]:
    """Share of the squared error in free space that the oracle removes and the diagnosis removed, too."""
    out: list[float] = []
    for numbers in map(_numbers, cases):
        if numbers is not None and numbers[2] <= WORTH * numbers[0]:
            before, after, oracle = np.square(numbers)
            out.append(float((before - after) / (before - oracle)))
    return out


def _numbers(case: CaseScore) -> tuple[float, float, float] | None:
    three = (case.free_space_before_m, case.free_space_after_m, case.oracle_free_space_m)
    if three[0] is None or three[1] is None or three[2] is None:
        return None
    return three[0], three[1], three[2]


def _free_space_line(label: str, cases: Sequence[CaseScore]) -> FreeSpaceLine:
    middle = np.median([n for n in map(_numbers, cases) if n is not None], axis=0)
    return FreeSpaceLine(label, len(cases), float(middle[0]), float(middle[1]), float(middle[2]))
