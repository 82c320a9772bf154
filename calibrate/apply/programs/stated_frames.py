"""Where the frames and tools of a program are: one rule for all dialects.

What the file declares is used. What it only names, or leaves to the state of the controller, the user states for the
whole file; a target whose frame or tool is known to neither is left as it is, with the remedy. A tool that is not named
at all is that of the rig file. What a program sets holds until it sets another, along its calls, branches and loops.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from calibrate.apply.programs.literal import (
    LONGEST_MOVE,
    Literal,
    NamedPose,
    Targets,
    last_before,
    line_of,
)
from calibrate.errors import DataError

Floats = NDArray[np.float64]

SAME = 2e-6  # m and of a rotation matrix: rounding of what is written
CALL = re.compile(r"(?:\b(?P<started>DO|run)[ \t]+)?(?<![\w$.#])(?P<name>[A-Z_]\w*)[ \t]*\(", re.IGNORECASE)
BLOCKS = ("if", "switch", "loop", "scope")
CALLS = ("call", "started")
TESTED = {"while": "loop", "else": "else"}
BRANCH = "is set in a branch or a loop above, or not"
CALLERS = "is not the same at all calls of its routine"
LABEL = "is not the same on all ways to the label"
NOWHERE = NamedPose(refused="no way through the program is seen to lead there")  # behind a jump
DEEPEST = 50  # calls within calls that are followed
LOOPS = 8  # blocks within blocks: deeper, what a loop sets is not followed
Used = tuple[NamedPose, NamedPose]  # frame and tool


@dataclass(frozen=True)
class _Kind:
    name: str
    option: str
    unnamed: str  # the remedy where a program names none; empty: none is needed


FRAME = _Kind("frame", "--frame", "the file sets no frame before it; give it with --frame (0 0 0 0 0 0: robot's base)")
TOOL = _Kind("tool", "--tool", "")


def stated(
    targets: Targets, text: str, frame: Floats | None, tool: Floats | None, rig_tool: Floats, name: str
) -> tuple[Targets, Floats, Floats | None]:
    """Targets that can be corrected; (target, 4, 4) frame of each in the base; their tool, None for the rig file's.

    DataError where one stated frame or tool would stand for several, or for none.
    """
    of_poses = [one.used for one in targets.literals if not one.joints]
    _check_given(FRAME, frame, [place for frames, _ in of_poses for place in frames], name)
    _check_given(TOOL, tool, [place for _, tools in of_poses for place in tools], name)
    kept, bases, skipped = list[Literal](), list[Floats](), list(targets.skipped)
    names, poses = list[str](), list[Floats]()  # of the tools
    for one in targets.literals:
        base = np.eye(4)
        if not one.joints:
            used_frames, used_tools = one.used
            why = _unusable(FRAME, used_frames, frame) or _unusable(TOOL, used_tools, tool)
            if why:
                line = f"line {line_of(text, one.at)}"
                skipped.append(f"{line}: {'' if one.name == line else one.name + ': '}{why}; not corrected")
                continue
            base = _pose(used_frames[0], frame, base)
            names.append(used_tools[0].name)
            poses.append(_pose(used_tools[0], tool, rig_tool))
        kept.append(one)
        bases.append(base)
    if any(not _same(poses[0], other) for other in poses):
        raise DataError(
            f"{name}: targets have tools {_listed(set(names))}; give one of them with --tool, the rest is left alone"
        )
    if tool is None and poses and not _same(poses[0], rig_tool):
        tool = poses[0]
    return replace(targets, literals=tuple(kept), skipped=tuple(dict.fromkeys(skipped))), np.array(bases), tool


def _check_given(kind: _Kind, given: Floats | None, places: Sequence[NamedPose], name: str) -> None:
    if given is None or not places:
        return
    left_open = {place.name for place in places if place.T is None and not place.refused}
    if len(left_open) > 1:
        raise DataError(
            f"{name}: targets are in the {kind.name}s {_listed(left_open)}, which the file does not hold, and "
            f"{kind.option} states one; declare them in the file, or correct a file for each"
        )
    known = _listed({place.name for place in places if not place.refused})
    if kind is FRAME and known and not left_open:
        raise DataError(f"{name}: the frames of all targets are known ({known}); leave --frame out")


def _unusable(kind: _Kind, used: Sequence[NamedPose], given: Floats | None) -> str:
    """Why a target with these frames, or tools, cannot be corrected; empty where it can."""
    for place in used:
        if place.refused:
            return place.refused
        if place.T is None and given is None and (place.name or kind.unnamed):
            named = f"the pose of {place.name} is not in this file; declare it there, or give it with {kind.option}"
            return named if place.name else kind.unnamed
        if kind is TOOL and place.T is not None and given is not None and not _same(place.T, given):
            return f"the tool {place.name}, as the file declares it, is not the one of --tool"
    if any(not _same(_pose(place, given, np.eye(4)), _pose(used[0], given, np.eye(4))) for place in used):
        names = _listed({place.name for place in used})
        return f"it is used in several {kind.name}s ({names}); give each its own target"
    return ""


def _pose(place: NamedPose, given: Floats | None, otherwise: Floats) -> Floats:
    instead = otherwise if given is None else given
    return instead if place.T is None else place.T


def _same(one: Floats, other: Floats) -> bool:
    return bool(np.allclose(one, other, rtol=0.0, atol=SAME))


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(name or "not named" for name in names))


@dataclass(frozen=True)
class Event:
    """A place where a program sets a frame (or a tool, which is followed by itself), or branches.

    `kind`: routine, call, started (as a thread or an interrupt), set, if, switch, loop, scope, else (the next branch),
    tested (behind the condition of a loop or branch), otherwise (the last branch), break, return, goto, label, end
    (of the innermost block or routine; of a routine it becomes "left").
    """

    at: int
    kind: str
    name: str = ""  # of a routine or a label
    pose: NamedPose | None = None  # what is set; of a routine: with what it is entered where nothing here calls it
    words: frozenset[str] = frozenset()  # parameters of a routine; names in what is set


def set_above(events: Sequence[Event], first: NamedPose, word: str) -> Callable[[int], NamedPose]:
    """The frame at each place, as the program sets it on its way there; `word`: what the dialect calls it.

    Where branches, loops or callers lead there with different ones, it is refused.
    """
    flow = _Flow(sorted(events, key=lambda event: event.at), first, word)
    known, starts = flow.known(), [event.at for event in flow.events]
    return lambda at: last_before(known, starts, at, first)


def routines_of(
    code: str, begins: re.Pattern[str], branches: re.Pattern[str], caller: NamedPose | None = None
) -> list[Event]:
    """Where routines begin, branch and are called; `caller`: with what all but the first are entered from outside."""
    begun = list(begins.finditer(code))
    ways = [(match, match.lastgroup or "") for match in branches.finditer(code)]
    # Calls in a condition, and in what is returned, come first; conditions of TESTED are theirs, each time.
    events = [Event(match.start(), TESTED[kind]) for match, kind in ways if kind in TESTED]
    events += [Event(match.end(), "tested" if kind in TESTED else kind) for match, kind in ways]
    for k, match in enumerate(begun):
        words = words_of(match["parameters"])
        events.append(Event(match.start("name"), "routine", match["name"].lower(), caller if k else None, words))
    names, own = {event.name for event in events}, {match.start("name") for match in begun}
    for match in CALL.finditer(code):
        if (name := match["name"].lower()) in names and match.start("name") not in own:
            events.append(Event(closed(code, match.end() - 1), "started" if match["started"] else "call", name))
    return events


def closed(code: str, at: int) -> int:
    """Where the first parenthesis from a place on is closed, or the place: calls in it come first."""
    depths = accumulate((letter == "(") - (letter == ")") for letter in code[at : at + LONGEST_MOVE])
    return next((at + k for k, depth in enumerate(depths) if depth == 0 and code[at + k] == ")"), at)


def words_of(text: str) -> frozenset[str]:
    return frozenset(re.findall(r"[a-z_]\w*", text.lower()))


class _Flow:
    def __init__(self, events: list[Event], first: NamedPose, word: str) -> None:
        self.events, self.first, self.word = events, first, word
        self.is_set = any(event.kind == "set" for event in events)
        self.bodies: dict[int, list[int]] = {-1: []}  # by the event that begins a routine; -1: outside of all
        self._split()
        self.names = {events[i].name: i for i in reversed(self.bodies) if i >= 0}
        self.seen: dict[int, NamedPose] = {}  # behind each event, on all ways there
        self.left: dict[tuple[int, int], NamedPose] = {}  # by routine and what it is entered with
        self.running: list[int] = []
        self.refused: dict[str, NamedPose] = {}

    def _split(self) -> None:
        opened: list[int | None] = [-1]  # None: a block
        for i, event in enumerate(self.events):
            if event.kind == "routine":
                opened.append(i)
                self.bodies[i] = []
            elif event.kind in BLOCKS:
                opened.append(None)
            elif event.kind == "end" and len(opened) > 1 and opened.pop() is not None:
                self.events[i] = replace(event, kind="left")
            self.bodies[next(one for one in reversed(opened) if one is not None)].append(i)

    def known(self) -> list[NamedPose]:
        called = {self.names[event.name] for event in self.events if event.kind in CALLS}
        for routine in sorted(self.bodies, key=lambda one: one in called):
            if all(key[0] != routine for key in self.left):
                self._run(routine, (self.events[routine].pose if routine >= 0 else None) or self.first)
        return [self.seen[i] for i in range(len(self.events))]

    def _run(self, routine: int, entry: NamedPose) -> NamedPose:
        """What holds behind a routine that is entered with this."""
        key = (routine, id(entry))
        if key in self.left:
            return self.left[key]
        if routine in self.running or len(self.running) > DEEPEST:
            return self._unknown("is set in a routine that calls itself", entry)
        self.running.append(routine)
        opened, ends = list[tuple[str, int, NamedPose, list[NamedPose]]](), list[NamedPose]()
        state, k, body = entry, 0, self.bodies[routine]
        jumps, jumped = dict[str, list[NamedPose]](), 0  # by label; how many of them labels were entered with
        while k < len(body):
            i, event = body[k], self.events[body[k]]
            if event.kind in BLOCKS:
                if event.kind == "loop" and len(opened) > LOOPS:
                    state = self._joined([state, self._unknown(BRANCH, state)])
                opened.append((event.kind, k, state, [state]))
                state = NOWHERE if event.kind == "switch" else state  # up to its first case
            elif event.kind == "end" and opened:
                kind, begin, entered, ways = opened.pop()
                state = entered if kind == "scope" else self._joined([*ways, state])
                if kind == "loop" and not alike(state, entered):
                    k = begin  # once more, as it is entered from its end
                    continue
            elif event.kind == "tested" and opened:
                kind, begin, entered, ways = opened[-1]
                opened[-1] = (kind, begin, entered if kind == "loop" else state, [state, *ways[1:]])
            elif event.kind in ("else", "otherwise") and opened:
                ways = opened[-1][3]
                ways[:] = [*(ways if event.kind == "else" else ways[1:]), state]
                state = opened[-1][2]
            elif event.kind == "break":
                next((ways for kind, _, _, ways in reversed(opened) if kind == "loop"), ends).append(state)
            elif event.kind == "return":
                ends.append(state)
            elif event.kind == "goto" and self.is_set:
                ways = jumps.setdefault(event.name, [])
                ways += [] if any(alike(state, other) for other in ways) else [state]
                state = NOWHERE
            elif event.kind == "label":
                state = self._joined([state, *jumps.get(event.name, [])], f"{LABEL} {event.name}")
            else:
                state = self._behind(event, state, routine)
            self.seen[i] = self._joined([self.seen.get(i, state), state], CALLERS)
            k += 1
            if k == len(body) and (known := sum(map(len, jumps.values()))) > jumped:
                state, k, jumped = entry, 0, known  # once more: labels above are entered from below
        self.running.pop()
        self.left[key] = self._joined([*ends, state])
        return self.left[key]

    def _behind(self, event: Event, state: NamedPose, routine: int) -> NamedPose:
        if event.kind == "set" and event.pose:
            given = routine >= 0 and event.words & self.events[routine].words
            why = f"is set from a parameter of the routine {self.events[routine].name}"
            return self._refuse(why) if given else event.pose
        if event.kind not in CALLS:
            return state
        any_moment, started = f"is that of any moment at which {event.name} may be started", event.kind == "started"
        entry = self._unknown(any_moment, state) if started else state
        left = self._run(self.names[event.name], entry)
        if left is entry:
            return state
        return self._refuse(f"is set in the called routine {event.name}") if started or left.refused else left

    def _refuse(self, why: str) -> NamedPose:
        return self.refused.setdefault(why, NamedPose(refused=f"the {self.word} {why}"))

    def _unknown(self, why: str, state: NamedPose) -> NamedPose:
        return self._refuse(why) if self.is_set else state

    def _joined(self, ways: Sequence[NamedPose], why: str = BRANCH) -> NamedPose:
        ways = [one for one in ways if one is not NOWHERE] or [NOWHERE]
        if all(alike(ways[0], other) for other in ways):
            return ways[0]
        return next((one for one in ways if one.refused), self._refuse(why))


def alike(one: NamedPose, other: NamedPose) -> bool:
    """The same numbers, or where one is not known the same name."""
    if one.T is None or other.T is None:
        return one.T is other.T and (one.name, one.refused) == (other.name, other.refused)
    return np.array_equal(one.T, other.T) and one.refused == other.refused
