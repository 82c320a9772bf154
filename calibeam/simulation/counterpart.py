"""An entry of the table in mechanism_table.py: the effects that it takes, and the mechanism that they become."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from operator import attrgetter
from typing import Any, cast

from calibeam.simulation.found import FoundEffect
from calibrate.model.effects.term import (
    Shape,
)
from simulators.defects import Defect

Source = str | float | Callable[[FoundEffect], object]
NUMBER, JOINTS = attrgetter("number"), attrgetter("session.drivers.n_joints")
THERMOMETER = attrgetter("thermometer")
USUAL: dict[str, Callable[[FoundEffect], Any]] = {
    "joint": NUMBER,
    "link": NUMBER,
    "psd": NUMBER,
    "joints": JOINTS,
    "at_s": attrgetter("at_s"),
    "half_size_m": attrgetter("session.light.half_size_m"),
}  # of fields that mean the same in every mechanism


@dataclass(frozen=True)
class Form:
    """The effects that an entry takes, by patterns (`fnmatch`); what is not stated takes any."""

    physics: str
    name: str = "all of it"  # which of the effect's forms, for a person
    variants: tuple[str, ...] = ("*",)
    driver: str = "*"
    port: str = "*"
    size: str = ""  # a parameter that it has
    shape: Shape | None = None

    def takes(self, found: FoundEffect) -> bool:
        return (
            found.term.physics == self.physics
            and any(fnmatchcase(found.variant, pattern) for pattern in self.variants)
            and fnmatchcase(found.driver, self.driver)
            and fnmatchcase(found.port.where, self.port)
            and (not self.size or self.size in found.sizes)
            and self.shape in (None, found.term.shape)
        )


class Counterpart:
    """The mechanism that an effect becomes: by `make`, or field by field from `sources`.

    A source is the name of a parameter of the effect, a function of the effect, or a value. A field without one is as
    in `USUAL`, or the parameter of the same name, or keeps its default.
    """

    def __init__(
        self,
        mechanism: type[Defect],
        crosses: str,  # what crosses over, with its unit
        make: Callable[[FoundEffect], Defect] | None = None,
        *,
        within: float = 0.02,  # share of the effect's size by which the two may differ
        differs: str = "",  # why, where it is more than two per cent
        **sources: Source,
    ) -> None:
        self.mechanism, self.crosses, self.within, self.differs = mechanism, crosses, within, differs
        self._make, self._sources = make, sources

    def of(self, found: FoundEffect) -> Defect:
        """KeyError for a driver that the simulators cannot follow."""
        if self._make is not None:
            return self._make(found)
        names = [field.name for field in fields(cast("Any", self.mechanism))]
        usual = {**{name: name for name in found.sizes}, **USUAL, **self._sources}
        return self.mechanism(**{name: _value(found, usual[name]) for name in names if name in usual})


def times(factor: float, size: str) -> Callable[[FoundEffect], float]:
    """That parameter of the effect times a factor."""
    return lambda found: factor * found.size(size)


def _value(found: FoundEffect, source: Source) -> Any:
    if isinstance(source, str):
        return found.size(source)
    return source(found) if callable(source) else source
