"""How far a session is, told to whoever shows it."""

import enum
from collections.abc import Callable
from dataclasses import dataclass


class Phase(enum.Enum):
    """What the arm is doing, in a word for a person."""

    PLACE = "fixture"
    AIM = "aim"
    CENTRE = "centre"
    COLLECT = "collect"
    REPEAT = "repeat"


@dataclass(frozen=True)
class Progress:
    """Poses of the plan, those of earlier parts of the session among them."""

    phase: Phase
    done: int
    total: int
    skipped: int
    placement: int
    first: int  # face that the beam strikes first

    @property
    def left(self) -> int:
        """Poses still to be taken."""
        return max(0, self.total - self.done - self.skipped)


Tell = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """For a session that nobody looks at."""
