"""One target as it stands in the text of a program, and how a dialect describes such texts."""

import re
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.files import shown
from calibrate.apply.correct.corrected import Branch
from calibrate.apply.correct.rotations import RotationForm, pose
from calibrate.errors import DataError

Floats = NDArray[np.float64]
Span = tuple[int, int]
Notes = tuple[str, ...]
Axes = tuple[tuple[str, float], ...]  # external axes: name, and mm or degrees as written; NaN: computed
T = TypeVar("T")

UNIT = 1e-2  # by which the length of a quaternion may differ from 1: rounding of two decimals
EDGE_RAD = 1e-3  # across the edge of a quarter turn, or of the sign of an axis, an angle may be by rounding of its pose

NUMBER = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?"  # no number is tried again, digit by digit
ELEMENT = re.compile(r"(\w+)[\[{]([^:]*)[\]}]")  # of an array: its name and index
OPENING = re.compile(r"[\s\[{]*(?:\w+\s*:)?\s*")  # before the first number of what is written out
SHORT_IF = re.compile(r"\bIF\b(?!.*\bTHEN\b)", re.IGNORECASE | re.DOTALL)  # for the next instruction only
LONGEST_MOVE = 500  # letters that are read of an instruction; with a target in it one has some 200


@dataclass(frozen=True, eq=False)
class NamedPose:
    """A frame, or a tool, as a program names it. `T` (4, 4) in the base, or in the flange; None: not in this file."""

    name: str = ""  # for a person; empty: the program names none
    T: Floats | None = None
    refused: str = ""  # why no target with it can be corrected


@dataclass(frozen=True, eq=False)
class Move:
    """An instruction that goes to a target: where its line begins, its text, frame and tool."""

    line_start: int
    text: str
    frame: NamedPose = NamedPose()
    tool: NamedPose = NamedPose()
    alone: bool = True  # what stands before it neither chooses whether it runs nor shares its line


Moves = dict[str, list[Move]]  # by the key of their target
Places = Callable[[int], tuple[NamedPose, NamedPose]]  # where an instruction begins -> its frame and tool
Turns = Callable[[Floats], list[tuple[Span, str]]]  # joint angles (joint,) -> its configuration, where that changes


@dataclass(frozen=True, eq=False)
class Literal:
    """`numbers` as they are written, in the order x, y, z and orientation, or joint by joint."""

    name: str  # for a person: the target's own, or that of its line
    at: int  # of its first character
    spans: tuple[Span, ...]
    numbers: tuple[float, ...]
    joints: bool
    moves: tuple[Move, ...] = ()
    branch: Branch | None = None
    turns: Turns | None = None
    own: tuple[NamedPose, NamedPose] | None = None  # frame and tool that it names itself; None: those of its moves
    near: tuple[float, ...] = ()  # joint by joint, as written: the posture that it asks for; empty: it asks for none
    external: Axes = ()

    @property
    def used(self) -> tuple[tuple[NamedPose, ...], tuple[NamedPose, ...]]:
        """Frames and tools with which it is used."""
        uses = (self.own,) if self.own else tuple((move.frame, move.tool) for move in self.moves)
        frames, tools = zip(*uses or ((NamedPose(), NamedPose()),), strict=True)
        return frames, tools


@dataclass(frozen=True)
class Targets:
    """`skipped`: sentences about moves whose target is no literal that can be corrected."""

    literals: tuple[Literal, ...]
    skipped: tuple[str, ...]
    absent: tuple[str, ...] = ()  # sentences about routines that are called and are not in the file
    external: Axes = ()  # of aggregates that are no literal
    moves: tuple[Move, ...] = ()  # to targets that are `skipped`


@dataclass(frozen=True)
class Dialect:
    """A language of programs. `mm`: lengths in mm and angles in degrees, else in m and rad."""

    name: str
    make: str
    suffixes: tuple[str, ...]
    find: Callable[[str, int], Targets]  # text, number of joints
    rotation: RotationForm
    mm: bool
    length_digits: int
    angle_digits: int
    overshoot: Callable[[Move, Sequence[str]], str] | None  # the line of a move to joint angles; None: not possible
    motion: re.Pattern[str]  # the beginning of every instruction that moves the arm, whether its target is read or not
    comment: str  # what begins one

    def pose_numbers(self, position_m: Floats, R: Floats) -> list[str]:
        turn = self.rotation.from_matrix(R[None])[0]
        quaternion = len(self.rotation.names) == 4
        angles = turn if quaternion or not self.mm else np.degrees(turn)
        lengths = position_m * (1e3 if self.mm else 1.0)
        return [fixed(v, self.length_digits) for v in lengths] + [fixed(v, self.angle_digits) for v in angles]

    def joint_numbers(self, q_rad: Floats) -> list[str]:
        return [fixed(v, self.angle_digits) for v in (np.degrees(q_rad) if self.mm else q_rad)]

    def joints_rad(self, numbers: Sequence[float]) -> Floats:
        q = np.array(numbers)
        return np.radians(q) if self.mm else q

    def frame(self, numbers: Sequence[float]) -> Floats:
        """(4, 4) of a pose as it is written."""
        turn = np.array(numbers[3:])
        if len(turn) == 4 and abs(float(np.linalg.norm(turn)) - 1.0) > UNIT:
            raise DataError(f"quaternion {turn.tolist()}: its length is not 1; correct it")
        angles = turn if len(turn) == 4 or not self.mm else np.radians(turn)
        position_m = np.array(numbers[:3]) * (1e-3 if self.mm else 1.0)
        return pose(position_m[None], self.rotation.to_matrix(angles[None]))[0]


def fixed(value: float, digits: int) -> str:
    """Without an exponent, which not every controller reads; never "-0"."""
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def unread(text: str, code: str, pattern: re.Pattern[str], literals: Sequence[Literal]) -> list[tuple[int, str]]:
    """Targets as the pattern writes them that are in no literal: what is not corrected is at least listed."""
    spans = sorted(span for one in literals for span in one.spans)
    begins = [begin for begin, _ in spans]
    return [
        (match.start(), f"a target that no move of this file is seen to go to is left as it is: {shown(match.group())}")
        for match in pattern.finditer(code)
        if bisect_left(begins, match.start()) == bisect_left(begins, match.end())
    ]


def line_of(text: str, at: int) -> int:
    return bisect_left(_line_ends(text), at) + 1


@lru_cache(maxsize=2)  # the program, and the same without its comments
def _line_ends(text: str) -> list[int]:
    return [match.start() for match in re.finditer("\n", text)]


def last_before(states: Sequence[T], starts: Sequence[int], at: int, otherwise: T) -> T:
    """The state since the last of the ascending `starts` before a place."""
    k = bisect_left(starts, at)
    return states[k - 1] if k else otherwise


def built_in(names: str) -> re.Pattern[str]:
    """Of names, or patterns of them, between spaces."""
    return re.compile("|".join(names.split()), re.IGNORECASE)


def absent(code: str, calls: Iterable[re.Match[str]], held: re.Pattern[str], own: re.Pattern[str], sets: str) -> Notes:
    """On each routine that is neither `held` by the file nor the controller's `own`, where it is called first."""
    names, first = {match["name"].lower() for match in held.finditer(code)}, dict[str, str]()
    for match in calls:
        name, line = match["name"], line_of(code, match.start("name"))
        if name.lower() not in names and not own.fullmatch(name):
            says = f"line {line}: {name} is not in this file: if it {sets}, the targets after it are wrong"
            first.setdefault(name.lower(), says)
    return tuple(first.values())


def arguments(call: str) -> list[str]:
    """Between the commas that stand in no brackets."""
    parts, depth = [""], 0
    for letter in call:
        depth += (letter in "[(") - (letter in "])")
        parts[-1] += letter
        if letter == "," and depth == 0:
            parts[-1:] = [parts[-1][:-1], ""]
    return parts


def line_start(text: str, at: int) -> int:
    return text.rfind("\n", 0, at) + 1


def numbers_in(text: str, begin: int, end: int) -> Iterator[tuple[Span, float]]:
    """Each number between two places of a text."""
    for match in re.compile(NUMBER).finditer(text, begin, end):
        yield match.span(), float(match.group())


def blanked(text: str, comment: str) -> str:
    """The same length, with spaces where comments and strings stand: nothing in them is a target."""
    pattern = re.compile(rf'"[^"\n]*"|{comment}[^\n]*')
    return pattern.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def instruction(text: str, at: int, places: Places, end: str = "\n") -> Move:
    """The one that begins at a place of the text, with what stands before it in its line."""
    start, stop = line_start(text, at), text.find(end, at, at + LONGEST_MOVE)
    since = blanked(text[max(0, start - LONGEST_MOVE) : at], "!").rpartition(";")[2] if end == ";" else ""
    alone = not text[start:at].strip() and SHORT_IF.search(since) is None
    return Move(start, text[start : at + LONGEST_MOVE if stop < 0 else stop + len(end.strip())], *places(at), alone)


def moves_of(text: str, code: str, patterns: Sequence[re.Pattern[str]], places: Places, end: str = "\n") -> Moves:
    """By what an instruction moves to, the group `target` of a pattern; by its place where it is written out there."""
    found: Moves = {}
    for match in (m for pattern in patterns for m in pattern.finditer(code)):
        name = str(match.start("target")) if match["target"][-1] in "[{" else key(match["target"])
        found.setdefault(name, []).append(instruction(text, match.start(), places, end))
    return found


def key(target: str) -> str:
    """A name as programs compare it."""
    return re.sub(r"\s", "", target).lower()


def moves_to(by_name: Moves, name: str) -> tuple[Move, ...]:
    """Instructions that go to a target, or, of an array, to an element that only its index at run time chooses."""
    found = list(by_name.get(key(name), ()))
    if (element := ELEMENT.fullmatch(key(name))) is not None:
        found += [
            move
            for target, moves in by_name.items()
            if (other := ELEMENT.fullmatch(target)) and other[1] == element[1] and not other[2].isdigit()
            for move in moves
        ]
    return tuple(found)


def sentences(
    code: str, by_name: Moves, literals: Sequence[Literal], changed: re.Pattern[str], others: Iterable[tuple[int, str]]
) -> tuple[str, ...]:
    """On moves to what is none of the literals, on assignments that `changed` one, and on `others`: where, and why."""
    known = {key(one.name) for one in literals}
    arrays = {element[1] for name in known if (element := ELEMENT.fullmatch(name))}
    known |= {t for t in by_name if (e := ELEMENT.fullmatch(t)) and e[1] in arrays and not e[2].isdigit()}
    begins = sorted(one.at for one in literals)

    def written_out(at: int) -> bool:
        k = bisect_left(begins, at)
        return k < len(begins) and OPENING.fullmatch(code, at, begins[k]) is not None

    other_lines = [
        (move.line_start, f"{' '.join(move.text.split())}: its target is no literal of this file")
        for target, moves in by_name.items()
        if target not in known and not (target.isdigit() and written_out(int(target)))
        for move in moves
    ]
    used = {key(one.name) for one in literals if one.moves}
    for match in changed.finditer(code):
        name = key(match["name"])
        if (element := ELEMENT.fullmatch(name)) and (element[1] not in arrays or not element[2].isdigit()):
            name = element[1]  # a number of a pose, or an element that only its index at run time chooses
        if name in used | arrays and not written_out(match.end()):
            line = code[match.start("name") :].split("\n", 1)[0]
            other_lines.append((match.start("name"), f"{shown(line)}: changes a target while the program runs"))
    listed = {line_of(code, at) for at, _ in other_lines}
    more = [(at, why) for at, why in others if line_of(code, at) not in listed]  # an instruction is listed once
    return tuple(dict.fromkeys(f"line {line_of(code, at)}: {why}" for at, why in (*other_lines, *more)))
