"""What a named transform of a task can be: known, still to be taught, read by a camera, or carried by a belt."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Source(Protocol):
    """Where a transform comes from. `s_m`: how far the belt has gone, m."""

    @property
    def moves(self) -> bool:
        """Whether it depends on s."""
        ...

    def at(self, s_m: float) -> Floats | None:
        """(4, 4), or None where it is not known yet."""
        ...

    @property
    def why_unknown(self) -> str:
        """What would make it known, for a message."""
        ...


@dataclass(frozen=True, eq=False)
class Constant:
    """Known, from a drawing or taught."""

    T: Floats
    moves = False
    why_unknown = ""

    def at(self, s_m: float) -> Floats:
        return self.T


@dataclass(frozen=True)
class Untaught:
    """Has to be taught by placing the arm."""

    moves = False
    why_unknown = "not taught yet"

    def at(self, s_m: float) -> None:
        return None


@dataclass(frozen=True)
class Unread:
    """Comes from a reading of a camera during the program."""

    moves = False
    why_unknown = "its camera was not read yet"

    def at(self, s_m: float) -> None:
        return None


@dataclass(frozen=True, eq=False)
class Carried:
    """A function of the belt's way."""

    by: Callable[[float], Floats]
    moves = True
    why_unknown = ""

    def at(self, s_m: float) -> Floats:
        return self.by(s_m)


@dataclass(frozen=True, eq=False)
class Belt:
    """A straight belt: the pose at s = 0, shifted along a unit direction of its own frame by s."""

    T_at_zero: Floats
    direction: Floats  # (3,)
    moves = True
    why_unknown = ""

    def at(self, s_m: float) -> Floats:
        T = self.T_at_zero.copy()
        T[:3, 3] += T[:3, :3] @ self.direction * s_m
        return T
