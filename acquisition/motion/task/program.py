"""A program as data: MOVE, GRASP, RELEASE, READ, FOR; and what is left of it once its loops are unrolled.

program = (For("i", (1, 2), (Move("pin"), Grasp(), Move("hole {i}", by="line"), Release())),)

A task file writes the same steps as tables (task_file.py).
"""

import re
from collections.abc import Iterator, Mapping
from typing import Literal

from msgspec import Struct

from acquisition.errors import TaskError
from acquisition.recording.files.bounds import Few, Name, Seconds, Whole


class Move(Struct, frozen=True, forbid_unknown_fields=True, tag="move", tag_field="do"):
    """To a position of the task; `time_s`: not faster than this. `stop`: through the very place, which takes a rest."""

    to: Name
    by: Literal["joint", "line"] = "joint"
    time_s: Seconds = 0.0
    stop: bool = False


class Grasp(Struct, frozen=True, forbid_unknown_fields=True, tag="grasp", tag_field="do"):
    """Close the hand where the arm stands, and wait."""

    wait_s: Seconds = 0.0


class Release(Struct, frozen=True, forbid_unknown_fields=True, tag="release", tag_field="do"):
    """Open the hand where the arm stands, and wait."""

    wait_s: Seconds = 0.0


class Read(Struct, frozen=True, forbid_unknown_fields=True, tag="read", tag_field="do"):
    """Take a transform of the task from its camera; the arm stands meanwhile."""

    transform: Name


class For(Struct, frozen=True, forbid_unknown_fields=True, tag="for", tag_field="do"):
    """The steps once for every value; {each} in a name stands for it."""

    each: Name
    of: Few[Name | Whole]
    step: Few["Step"]


Step = Move | Grasp | Release | Read | For
Plain = Move | Grasp | Release | Read


def unrolled(steps: tuple[Step, ...], values: Mapping[str, str | int] | None = None) -> Iterator[Plain]:
    """The steps one after the other. TaskError for {names} that no FOR gives a value."""
    given = values or {}
    for step in steps:
        match step:
            case For(each, of, inner):
                for value in of:
                    yield from unrolled(inner, {**given, each: value})
            case Move(to, by, time_s, stop):
                yield Move(filled(to, given), by, time_s, stop)
            case Read(name):
                yield Read(filled(name, given))
            case _:
                yield step


def loops(steps: tuple[Step, ...]) -> dict[str, tuple[str | int, ...]]:
    """Every loop variable with all values it takes anywhere in the program."""
    out: dict[str, tuple[str | int, ...]] = {}
    for step in steps:
        if isinstance(step, For):
            inner = loops(step.step)
            for name, values in ((step.each, step.of), *inner.items()):
                out[name] = tuple(dict.fromkeys((*out.get(name, ()), *values)))
    return out


def filled(text: str, values: Mapping[str, str | int]) -> str:
    """{i} in a name replaced by the value of i. TaskError where there is none."""

    def value(match: re.Match[str]) -> str:
        if match[1] not in values:
            raise TaskError(f'"{text}": {match[1]} has no value here; a FOR around the step must give it one')
        return str(values[match[1]])

    return re.sub(r"{(\w+)}", value, text)
