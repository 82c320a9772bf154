"""What a mechanism is, and the places where it may take hold of the chain.

A defect is a frozen record of what is physically wrong, with one quantity (`SIZE`) that scales it: zero changes
nothing. It takes hold by having one or more of the methods below; the chain looks for them and calls each at its
place. A new mechanism is one file and one line in `mechanisms.MECHANISMS`.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, Protocol, Self, TypeVar

import numpy as np

from simulators.defects.site import Site


class Defect(Protocol):
    """One hidden mechanism."""

    KIND: ClassVar[str]  # the mechanism's own name
    PHYSICS: ClassVar[str]  # as in the interchange format; "unknown" when no catalogue has it
    SIZE: ClassVar[str]  # the field that scales it
    TYPICAL: ClassVar[float]  # a plausible value of that field, in its unit
    INSTRUMENTS: ClassVar[tuple[str, ...]]  # where it can occur
    HABIT: ClassVar[str]  # how a session must be run to show it: "moving", "direct", "payload" or "" for any

    @property
    def port(self) -> str:
        """Where it sits: `joint3.angle`, ... as in the interchange format."""
        ...

    @property
    def drivers(self) -> tuple[str, ...]:
        """What it depends on: `q3`, ... as in the interchange format."""
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        """Columns without which nobody could name it; `temp_room_degC`, `approach`, ... (no number: of every joint)."""
        ...

    @property
    def figures(self) -> Mapping[str, float]:
        """Its size in the words of a diagnosis, e.g. `amplitude_rad`; empty when there is no single number."""
        ...

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        """A plausible one. UnsuitedError when the rig or session has no room for it."""
        ...


AnyDefect = TypeVar("AnyDefect", bound=Defect)


def with_size(defect: AnyDefect, size: float) -> AnyDefect:
    """The same mechanism with another size."""
    changed: Any = defect
    return replace(changed, **{defect.SIZE: size})


def size_of(defect: Defect) -> float:
    """The value of the field that scales the mechanism."""
    return float(getattr(defect, defect.SIZE))
