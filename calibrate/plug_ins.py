"""What installed packages bring: entry points of the groups below, looked up when a catalogue is first needed.

A package that cannot be loaded is left out with one message on standard error that names it. Nothing is looked up by
the import of this module.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

DEVICES, SENSORS, EFFECTS = "calibeam.devices", "calibeam.sensors", "calibeam.effects"
EXPORTS = "calibeam.exports"
T = TypeVar("T")


class PlugInError(Exception):
    """A plug-in that cannot be used; the message names it, its package, and what is wrong."""


@dataclass(frozen=True)
class PlugIn:
    """One entry point, not loaded yet."""

    name: str
    package: str  # with its version
    entry: EntryPoint

    def load(self, fits: Callable[[object], bool], what: str) -> object:
        """What it points to. PlugInError where it cannot be loaded or is not `what`."""
        try:
            found = self.entry.load()
        except Exception as why:  # whatever a stranger's module raises
            raise PlugInError(f"{self._place} cannot be loaded: {type(why).__name__}: {why}") from why
        if not fits(found):
            raise PlugInError(f"{self._place}: {self.entry.value} is a {type(found).__name__}, not {what}")
        return found

    @property
    def _place(self) -> str:
        return f"plug-in '{self.name}' ({self.entry.group}) of the package {self.package}"


def plug_ins(group: str) -> tuple[PlugIn, ...]:
    """Those of a group, by name; of two of one name the first package by name."""
    found = (PlugIn(entry.name, _package(entry), entry) for entry in entry_points(group=group))
    return tuple(sorted(found, key=lambda one: (one.name, one.package)))


def loaded(group: str, kind: type[T]) -> tuple[T, ...]:
    """All of a group that can be loaded and are of this kind; the others are named on standard error, once."""
    return tuple(one for one in _loaded(group, kind) if isinstance(one, kind))


@cache
def _loaded(group: str, kind: type[object]) -> tuple[object, ...]:
    return tuple(_good(group, kind))


def _good(group: str, kind: type[object]) -> Iterator[object]:
    for one in plug_ins(group):
        try:
            yield one.load(lambda found: isinstance(found, kind), f"a {kind.__module__}.{kind.__qualname__}")
        except PlugInError as why:
            print(f"{why}; it is left out", file=sys.stderr, flush=True)


def _package(entry: EntryPoint) -> str:
    return "?" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
