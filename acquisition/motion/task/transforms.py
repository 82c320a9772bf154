"""What a named transform of a task can be (known, still to be taught, read by a camera, carried by a belt), and
equations between transforms, `T6 TOOL = COORD POS`: as text, as a closed loop, and solved for one term.

An equation a b = c d is the loop a b d^-1 c^-1 = 1. Turned about until one term stands first, the inverse of the rest
is that term. Source: R. Paul, Robot Manipulators, 1981, ch. 1.11 and 5.2 (transform graphs).
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import TaskError
from acquisition.motion.kinematics import inverse

Floats = NDArray[np.float64]


class Source(Protocol):
    """Where a transform comes from. `s_m`: how far the belt has gone, m."""

    @property
    def moves(self) -> bool:
        """Whether it depends on s."""
        ...

    def at(self, s_m: float) -> Floats | None:
        """(4, 4), or None where it is not known yet."""
        ...

    @property
    def why_unknown(self) -> str:
        """What would make it known, for a message."""
        ...


@dataclass(frozen=True, eq=False)
class Constant:
    """Known, from a drawing or taught."""

    T: Floats
    moves = False
    why_unknown = ""

    def at(self, s_m: float) -> Floats:
        return self.T


class Unknown:
    """Not known yet."""

    moves = False
    why_unknown: ClassVar[str]

    def at(self, s_m: float) -> None:
        return None


@dataclass(frozen=True)
class Untaught(Unknown):
    """Has to be taught by placing the arm."""

    why_unknown = "not taught yet"


@dataclass(frozen=True)
class Unread(Unknown):
    """Comes from a reading of a camera during the program."""

    why_unknown = "its camera was not read yet"


@dataclass(frozen=True, eq=False)
class Carried:
    """A function of the belt's way."""

    by: Callable[[float], Floats]
    moves = True
    why_unknown = ""

    def at(self, s_m: float) -> Floats:
        return self.by(s_m)


@dataclass(frozen=True, eq=False)
class Belt:
    """A straight belt: the pose at s = 0, shifted along a unit direction of its own frame by s."""

    T_at_zero: Floats
    direction: Floats  # (3,)
    moves = True
    why_unknown = ""

    def at(self, s_m: float) -> Floats:
        T = self.T_at_zero.copy()
        T[:3, 3] += T[:3, :3] @ self.direction * s_m
        return T


ARM = "T6"  # the flange in the robot's base: what the arm itself provides
_TERM = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)(\^-1|⁻¹)?")


@dataclass(frozen=True)
class Term:
    """One transform in an equation, or its inverse."""

    name: str
    inverted: bool = False

    @property
    def turned_round(self) -> "Term":
        return Term(self.name, not self.inverted)

    def __str__(self) -> str:
        return f"{self.name}^-1" if self.inverted else self.name


@dataclass(frozen=True)
class Equation:
    """Products that are the same transform."""

    left: tuple[Term, ...]
    right: tuple[Term, ...]

    def __str__(self) -> str:
        return f"{' '.join(map(str, self.left))} = {' '.join(map(str, self.right))}"

    @property
    def names(self) -> frozenset[str]:
        return frozenset(term.name for term in (*self.left, *self.right))

    def equal_to(self, name: str) -> tuple[Term, ...]:
        """The product that `name` is, all else known. TaskError where it does not stand in the equation just once."""
        loop = [*self.left, *(term.turned_round for term in reversed(self.right))]
        places = [i for i, term in enumerate(loop) if term.name == name]
        if len(places) != 1:
            raise TaskError(
                f"{self}: {name} stands in it {len(places)} times; an equation can be solved for a transform that "
                "stands in it once"
            )
        (i,) = places
        rest = (*loop[i + 1 :], *loop[:i])  # name^(+-1) rest = 1
        return rest if loop[i].inverted else tuple(term.turned_round for term in reversed(rest))


def parse_equation(text: str) -> Equation:
    """From "Z T6 E = P PG^-1". TaskError where it is none."""
    sides = text.split("=")
    if len(sides) != 2:
        raise TaskError(f'"{text}": an equation has one "=", as in "Z T6 E = P PG"')
    return Equation(*(tuple(_term(word, text) for word in side.split()) for side in sides))


def product(terms: tuple[Term, ...], value: Callable[[str], Floats]) -> Floats:
    """(4, 4) of a product whose transforms are known; the empty product is the identity."""
    out = np.eye(4)
    for term in terms:
        T = value(term.name)
        out = out @ (inverse(T) if term.inverted else T)
    return out


def _term(word: str, text: str) -> Term:
    match = _TERM.fullmatch(word)
    if match is None:
        raise TaskError(f'"{text}": "{word}" is no transform; a name of letters and digits, or its inverse NAME^-1')
    return Term(match[1], match[2] is not None)
