"""Before a program moves: what it lacks, and what supplies each; and a task file with a transform that was taught.

READ fills its transforms in later, so they count as known from their step on.
"""

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import TaskError
from acquisition.motion.kinematics import rotation_vector
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.program import Grasp, Move, Read, Release, unrolled
from acquisition.motion.task.task_file import ReadSource, Task
from acquisition.motion.task.transforms import Untaught

Floats = NDArray[np.float64]

HAND = "there is no [hand] for GRASP and RELEASE: name the digital output that closes it"
BELT = "a position moves with a belt, and there is no [belt]: name its encoder, and m_per_turn"


def missing(task: Task, *, camera: bool) -> tuple[str, ...]:
    """Everything that the program lacks, each once and in its order; `camera`: the rig has a calibrated one."""
    return tuple(dict.fromkeys(_missing(task, camera)))


def _missing(task: Task, camera: bool) -> Iterator[str]:
    graph = task.graph
    for step in unrolled(task.program):
        match step:
            case Move(to):
                yield from _to_reach(task, graph, to)
            case Read(name):
                reading = task.read.get(name)
                yield from _to_read(name, reading, camera)
                for known in (name, reading.gives if reading is not None else None):
                    graph = graph if known is None else graph.with_value(known, np.eye(4))
            case Grasp() | Release():
                if task.hand is None:
                    yield HAND


def _to_reach(task: Task, graph: TaskGraph, position: str) -> Iterator[str]:
    """One line for each transform that stands in the way, so that a transform of many positions is named once."""
    if position not in graph.positions:
        yield f"'{position}' is not among the positions of the task: add it to [position], or correct the MOVE"
        return
    unknown = [
        name for name in sorted(graph.positions[position].names & graph.transforms.keys()) if _lacks(graph, name)
    ]
    yield from (_remedy(task, graph, name) for name in unknown)
    if not unknown and graph.place(position).coord is not None and task.belt is None:
        yield BELT


def _lacks(graph: TaskGraph, name: str) -> bool:
    try:
        graph.value(name)
    except TaskError:
        return True
    return False


def _remedy(task: Task, graph: TaskGraph, name: str) -> str:
    """What supplies a transform: a place to teach it at, or a READ before the MOVE that needs it."""
    if not isinstance(graph.transforms[name], Untaught):
        return f"{name} is used before it is read: READ it before the MOVE"
    at = next((teach.at for teach in task.teach if teach.transform == name), None)
    if at is None:
        return f"{name} is not taught: add a [[teach]] for it, or give its origin_m and rotation_rad"
    return f"{name} is not taught: `calibeam task teach`, with the arm placed at '{at}'"


def _to_read(name: str, reading: ReadSource | None, camera: bool) -> Iterator[str]:
    if reading is None:
        yield f"READ {name}: add [read.{name}] with a file, or with camera = true"
    elif reading.camera and not camera:
        yield f"READ {name}: the rig has no [camera] with a calibration; `calibeam camera` measures it"


def taught_text(text: str, name: str, T: Floats) -> str:
    """A task file in which `name` is known: its `untaught = true` gives way to T (4, 4), all else stays as it is.

    Both forms are found, NAME = { untaught = true } and the table [transform.NAME]. TaskError where there is neither.
    """
    origin_m = [round(float(value), 9) for value in T[:3, 3]]  # nanometres
    turn_rad = [round(float(value), 12) for value in rotation_vector(T[:3, :3])]
    quoted = rf'(?:{re.escape(name)}|"{re.escape(name)}")'
    inline = re.compile(rf"(?m)^(\s*(?:transform\.)?{quoted}\s*=\s*\{{[^}}\n]*?)untaught\s*=\s*true")
    table = re.compile(rf"(?ms)^(\[transform\.{quoted}\][^\[]*?^\s*)untaught\s*=\s*true")
    for pattern, between in ((inline, ", "), (table, "\n")):
        value = f"origin_m = {origin_m}{between}rotation_rad = {turn_rad}"
        new, count = pattern.subn(lambda match, value=value: match[1] + value, text, count=1)
        if count:
            return new
    raise TaskError(f"transform {name}: 'untaught = true' was not found in the file; give it a line of its own")
