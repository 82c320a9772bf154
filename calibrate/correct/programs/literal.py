"""One target as it stands in the text of a program, and how a dialect describes such texts."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.correct.corrected import Branch
from calibrate.correct.rotations import RotationForm

Floats = NDArray[np.float64]
Span = tuple[int, int]

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


@dataclass(frozen=True)
class Move:
    """An instruction that goes to a target: where its line begins, and its text."""

    line_start: int
    text: str


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
    frame: str = ""  # the user frame that it names, where it does


@dataclass(frozen=True)
class Targets:
    """`skipped`: sentences about moves whose target is no literal that can be corrected."""

    literals: tuple[Literal, ...]
    skipped: tuple[str, ...]


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

    def position_and_turn(self, numbers: Sequence[float]) -> tuple[Floats, Floats]:
        """(3,) m and (3, 3)."""
        turn = np.array(numbers[3:])
        angles = turn if len(turn) == 4 or not self.mm else np.radians(turn)
        return np.array(numbers[:3]) * (1e-3 if self.mm else 1.0), self.rotation.to_matrix(angles[None])[0]


def fixed(value: float, digits: int) -> str:
    """Without an exponent, which not every controller reads; never "-0"."""
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def line_of(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


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


def moves_of(text: str, code: str, pattern: re.Pattern[str]) -> dict[str, list[Move]]:
    """By what an instruction moves to, the group `target` of the pattern."""
    found: dict[str, list[Move]] = {}
    for match in pattern.finditer(code):
        start = line_start(text, match.start())
        end = text.find("\n", match.start())
        line = text[start : len(text) if end < 0 else end]
        found.setdefault(match["target"].lower(), []).append(Move(start, line))
    return found
