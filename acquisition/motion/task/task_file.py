"""A task as a TOML file: its transforms, positions, relations and program.

[transform.P]            # origin_m, rotation_rad; or untaught = true; or unread = true
[transform.CONV]         # with belt_direction: carried along it by the belt
[position]
"pin" = "Z T6 E = P PG"
[[teach]]                # transform, at: in the order in which they can be solved
[[step]]                 # do = "move" | "grasp" | "release" | "read" | "for"
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from msgspec import Struct

from acquisition.errors import TaskError
from acquisition.motion.kinematics import transform
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.program import Step, filled, loops
from acquisition.motion.task.transforms import Belt, Constant, Equation, Source, Unread, Untaught, parse_equation
from acquisition.recording.files import parse_toml, read_text
from acquisition.recording.files.bounds import ZERO, Direction, Few, Line, Name, Rotation, Vector


class TransformEntry(Struct, frozen=True, forbid_unknown_fields=True):
    """One named transform."""

    origin_m: Vector = ZERO
    rotation_rad: Rotation = ZERO
    untaught: bool = False
    unread: bool = False
    belt_direction: Direction | None = None


class Teach(Struct, frozen=True, forbid_unknown_fields=True):
    """The arm is placed at a position, and one transform of its equation follows."""

    transform: Name
    at: Name


class TaskEntries(Struct, frozen=True, forbid_unknown_fields=True):
    """The whole file."""

    transform: dict[Name, TransformEntry]
    position: dict[Name, Line]
    step: Few[Step] = ()
    relation: Few[Line] = ()
    teach: Few[Teach] = ()


@dataclass(frozen=True)
class Task:
    """What is where, and what to do."""

    graph: TaskGraph
    program: tuple[Step, ...]
    teach: tuple[Teach, ...] = ()


def read_task(path: Path) -> Task:
    """TaskError with the file's name for what cannot be read or contradicts itself."""
    entries = parse_toml(read_text(path, "task", TaskError), str(path), TaskError).checked(TaskEntries)
    try:
        return task_of(entries)
    except TaskError as error:
        raise TaskError(f"{path}: {error}") from error


def task_of(entries: TaskEntries) -> Task:
    """TaskError where names do not fit together."""
    values = loops(entries.step)
    positions: dict[str, Equation] = {}
    for name, text in entries.position.items():
        for filling in _fillings(f"{name} {text}", values):
            positions[filled(name, filling)] = parse_equation(filled(text, filling))
    sources = {name: _source(name, entry) for name, entry in entries.transform.items()}
    relations = tuple(parse_equation(text) for text in entries.relation)
    return Task(TaskGraph(sources, positions, relations), entries.step, entries.teach)


def _fillings(text: str, values: Mapping[str, tuple[str | int, ...]]) -> list[dict[str, str | int]]:
    """Every way to fill in the loop variables that stand in a text."""
    names = [name for name in values if f"{{{name}}}" in text]
    return [dict(zip(names, each, strict=True)) for each in product(*(values[name] for name in names))]


def _source(name: str, entry: TransformEntry) -> Source:
    if entry.untaught or entry.unread:
        if entry.untaught and entry.unread:
            raise TaskError(f"transform {name} is untaught and unread; it can only be one of them")
        return Untaught() if entry.untaught else Unread()
    T = transform(entry.origin_m, entry.rotation_rad)
    if entry.belt_direction is None:
        return Constant(T)
    direction = np.array(entry.belt_direction)
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise TaskError(f"transform {name}: belt_direction points nowhere")
    return Belt(T, direction / length)
