"""One figure of a standard: what was measured, what is permitted, and whether the one keeps to the other."""

from dataclasses import dataclass
from enum import Enum


class Judgement(Enum):
    """How a figure stands."""

    CONFORMS = "within the permissible error"
    FAILS = "beyond the permissible error"
    NOT_STATED = "no permissible error is stated"
    NOT_MEASURED = "the recording holds nothing of it"


@dataclass(frozen=True)
class Source:
    """Where a formula stands. Sections by their titles: clause numbers are named only where they were read."""

    standard: str
    section: str
    formula: str


@dataclass(frozen=True)
class Figure:
    """A value for the worst of what was measured, and the values it is the worst of."""

    symbol: str
    says: str
    source: Source
    unit: str
    value: float | None
    permitted: float | None
    judgement: Judgement
    taken: int  # measurements behind it: spheres, series, lengths
    asked: int  # by the standard; with fewer it is part of the test only
    each: tuple[tuple[str, float, float | None], ...] = ()  # what, value, permitted there
    also: tuple[tuple[str, float], ...] = ()  # further numbers that the standard reports beside it

    @property
    def complete(self) -> bool:
        """Whether the standard's own number of measurements was taken."""
        return self.taken >= self.asked


def judged(value: float | None, permitted: float | None) -> Judgement:
    """Of one value against its limit, both as magnitudes."""
    if value is None:
        return Judgement.NOT_MEASURED
    if permitted is None:
        return Judgement.NOT_STATED
    return Judgement.CONFORMS if abs(value) <= permitted else Judgement.FAILS
