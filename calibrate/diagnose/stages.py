"""Stages of a diagnosis: what one of them has found is not lost because a later one fails.

A stage that fails is a fault of the program or of its mathematics, never of the caller, so the reason is kept for the
file beside everything that is known, and no verdict may rest on what was not looked at.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TypeVar

from calibrate.errors import DataError

T = TypeVar("T")


class Stage(Enum):
    """Words of docs/formats.md, in the order in which they come."""

    FAULTS = "faults of the file"
    GEOMETRY = "geometry"
    SEARCH = "search"
    UNKNOWN = "unknown causes"
    PREDICTION = "prediction of unseen rows"
    ALTERNATIVES = "alternatives"
    SCATTER = "scatter without a driver"
    REPEATS = "misfit of repeats"
    TIME = "misfit that lasts"
    SIZES = "sizes"
    NOISE = "wander of the noise"
    PROOFS = "proofs"
    FLOORS = "noise floors"
    REJECTED = "rejected causes"
    BEYOND_NOISE = "comparison with the stated noise"
    FREE_SPACE = "tool error over the workspace"
    FAR_ROWS = "rows that no model explains"
    DETECTION = "detection limits"
    CONFUSABLE = "causes that the poses confuse"
    STREAMS = "streams"
    TORQUES = "torques in motion"


# Whoever has not been through all of these does not know whether something is there.
DECIDING = frozenset(
    {
        Stage.FAULTS,
        Stage.GEOMETRY,
        Stage.SEARCH,
        Stage.UNKNOWN,
        Stage.PREDICTION,
        Stage.SCATTER,
        Stage.REPEATS,
        Stage.TIME,
        Stage.BEYOND_NOISE,
    }
)
NOT_YET = "not reached: the diagnosis ended before it"


@dataclass(frozen=True)
class Incomplete:
    """A stage without a result, and why."""

    stage: Stage
    reason: str

    @property
    def not_reached(self) -> bool:
        """Whether it did not fail, but has still to come."""
        return self.reason == NOT_YET


@dataclass(eq=False)
class Stages:
    """Runs stages one after the other and keeps which of them failed. `begun` is called with each as it begins."""

    _failed: list[Incomplete] = field(default_factory=list[Incomplete])
    begun: Callable[[Stage], None] | None = None

    def attempt(self, stage: Stage, do: Callable[[], T], otherwise: T, *, refuses: bool = False) -> T:
        """The result of a stage; `otherwise` where it fails, and the reason is kept.

        A stage that `refuses` ends the diagnosis by a DataError: it names what is wrong with what was given.
        """
        if self.begun is not None:
            self.begun(stage)
        try:
            return do()
        except Exception as why:  # whatever it is, what the stages before have found has to survive it
            if refuses and isinstance(why, DataError):
                raise
            self._failed.append(Incomplete(stage, _reason(why)))
            return otherwise

    @property
    def failed(self) -> tuple[Incomplete, ...]:
        return tuple(self._failed)

    @property
    def undecided(self) -> bool:
        """Whether a stage failed without which nobody may call a session consistent."""
        return any(one.stage in DECIDING for one in self._failed)

    def not_yet(self, after: Stage) -> tuple[Incomplete, ...]:
        """What failed so far, and everything that comes after a stage."""
        order = list(Stage)
        return (*self.failed, *(Incomplete(stage, NOT_YET) for stage in order[order.index(after) + 1 :]))


def _reason(why: Exception) -> str:
    """In one line; with the place in the program where it is no error that speaks for itself."""
    if isinstance(why, DataError):
        return str(why)
    last = traceback.extract_tb(why.__traceback__)[-1]
    says = " ".join(str(why).split()) or "no message"
    return f"{type(why).__name__}: {says} ({Path(last.filename).name}, line {last.lineno}); please report it"
