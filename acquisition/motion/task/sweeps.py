"""From a program to what the arm does in one go: the segments of a path, up to the next reading of a camera."""

from collections.abc import Sequence

from acquisition.motion.errors import TaskError
from acquisition.motion.paths.segments import By, Segment
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.place import Place
from acquisition.motion.task.program import Grasp, Move, Plain, Read, Release

GRASP, RELEASE = "GRASP", "RELEASE"


def next_sweep(graph: TaskGraph, steps: Sequence[Plain]) -> tuple[tuple[Segment, ...], int]:
    """The segments before the next READ, and how many steps they are. TaskError where a position is not determined."""
    segments: list[Segment] = []
    place: Place | None = None
    for count, step in enumerate(steps):
        match step:
            case Read():
                return tuple(segments), count
            case Move(to, by, time_s, stop):
                place = graph.place(to)
                segments.append(Segment(to, By.LINE if by == "line" else By.JOINTS, place, time_s))
                if stop:
                    segments.append(Segment(f"stop at {to}", By.STAND, place))
            case Grasp(wait_s) | Release(wait_s):
                if place is None:
                    raise TaskError("GRASP or RELEASE before the first MOVE of a sweep: move somewhere first")
                action = GRASP if isinstance(step, Grasp) else RELEASE
                segments.append(Segment(f"{action} at {place.name}", By.STAND, place, wait_s, action=action))
    return tuple(segments), len(steps)
