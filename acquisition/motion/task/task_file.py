"""A task as a TOML file: its transforms, positions, relations and program.

[transform.P]            # origin_m, rotation_rad; or untaught = true; or unread = true
[transform.CONV]         # with belt_direction: carried along it by the belt
[position]
"pin" = "Z T6 E = P PG"
[[teach]]                # transform, at: in the order in which they can be solved
[[step]]                 # do = "move" | "grasp" | "release" | "read" | "for"
[hand]                   # output = "standard 0", closed = true: the digital output that GRASP and RELEASE switch
[belt]                   # m_per_turn, and [belt.encoder] as [devices.encoders] of a rig file, with one encoder
[read.PART]              # file = "part.toml"; or camera = true: what READ PART reads
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from msgspec import Struct

from acquisition.errors import TaskError
from acquisition.motion.kinematics import transform
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.program import Step, filled, loops
from acquisition.motion.task.transforms import Belt, Constant, Equation, Source, Unread, Untaught, parse_equation
from acquisition.recording.files import parse_toml, read_text
from acquisition.recording.files.bounds import ZERO, Direction, Few, FilePath, Line, Metres, Name, Rotation, Vector
from acquisition.recording.rig.devices import EncodersDevice

# Digital outputs of a UR controller in the order of their bits (RTDE guide, actual_digital_output_bits).
OUTPUTS = (*(f"standard {n}" for n in range(8)), *(f"configurable {n}" for n in range(8)), "tool 0", "tool 1")


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


class Hand(Struct, frozen=True, forbid_unknown_fields=True):
    """A hand that one digital output of the controller closes; `closed` is the level at which it is."""

    output: Literal[*OUTPUTS]  # type: ignore[valid-type]
    closed: bool = True

    @property
    def bit(self) -> int:
        """Of the output in the controller's word of all outputs (RTDE guide, actual_digital_output_bits)."""
        return OUTPUTS.index(self.output)


class BeltEncoder(Struct, frozen=True, forbid_unknown_fields=True):
    """How far the belt has gone, by one encoder on a bus. `m_per_turn` below 0: it counts against the belt."""

    m_per_turn: Metres
    encoder: EncodersDevice


class ReadSource(Struct, frozen=True, forbid_unknown_fields=True):
    """Where READ takes a transform from: a TOML file of origin_m and rotation_rad, or the rig's camera.

    The camera gives its board as seen from the flange. With the arm at position `at`, `gives` follows from that.
    """

    file: FilePath | None = None
    camera: bool = False
    at: Name | None = None
    gives: Name | None = None


class TaskEntries(Struct, frozen=True, forbid_unknown_fields=True):
    """The whole file."""

    transform: dict[Name, TransformEntry]
    position: dict[Name, Line]
    step: Few[Step] = ()
    relation: Few[Line] = ()
    teach: Few[Teach] = ()
    hand: Hand | None = None
    belt: BeltEncoder | None = None
    read: dict[Name, ReadSource] = {}


@dataclass(frozen=True)
class Task:
    """What is where, what to do, and with which devices beside the arm."""

    graph: TaskGraph
    program: tuple[Step, ...]
    teach: tuple[Teach, ...] = ()
    hand: Hand | None = None
    belt: BeltEncoder | None = None
    read: Mapping[str, ReadSource] = field(default_factory=dict[str, ReadSource])


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
    graph = TaskGraph(sources, positions, relations)
    for name, reading in entries.read.items():
        _check_reading(name, reading, graph)
    if entries.belt is not None and not entries.belt.m_per_turn:
        raise TaskError("[belt] m_per_turn = 0: state how far the belt moves in one turn of the encoder")
    return Task(graph, entries.step, entries.teach, entries.hand, entries.belt, entries.read)


def _check_reading(name: str, reading: ReadSource, graph: TaskGraph) -> None:
    """TaskError for a reading of nothing, from nowhere or from two places."""
    if not isinstance(graph.transforms.get(name), Unread):
        raise TaskError(f"[read.{name}]: {name} is not a transform with unread = true")
    if (reading.file is None) != reading.camera:
        raise TaskError(f"[read.{name}]: give it either a file or camera = true")
    if (reading.at is None) != (reading.gives is None):
        raise TaskError(f"[read.{name}]: at and gives belong together: with the arm at a position, a transform follows")
    if reading.at is not None and reading.at not in graph.positions:
        raise TaskError(f"[read.{name}]: {reading.at} is not among the positions of the task")
    if reading.gives is not None and not isinstance(graph.transforms.get(reading.gives), Unread):
        raise TaskError(f"[read.{name}]: {reading.gives} is not a transform with unread = true")


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
