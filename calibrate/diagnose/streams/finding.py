"""The report of a stream: a finding with place, size, sigma and when; or why there is none."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from calibrate.diagnose.doubts.diagnosis import Named
from calibrate.model.effects.term import Size


class Outcome(Enum):
    """Of one finder at one stream."""

    FOUND = "beyond the stream's own noise"
    ABSENT = "not beyond the stream's own noise"
    NOT_DETERMINABLE = "this motion does not show it"


@dataclass(frozen=True)
class StreamFinding:
    """One cause in a stream. `p`: of nothing at all looking like this; times on the clock of the named stream."""

    name: Named
    stream: str
    outcome: Outcome
    parameters: Mapping[str, Size]
    from_s: float | None
    to_s: float | None
    p: float
    says: str
    rivals: tuple[Named, ...] = ()
