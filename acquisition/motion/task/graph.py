"""The transforms of a task by name, the equations between them, and what follows for any one of them.

Relations always hold (P = CAM PC). Positions each hold at one place of the arm, with a T6 of their own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import TaskError
from acquisition.motion.kinematics import apart
from acquisition.motion.paths.segments import Place
from acquisition.motion.task.transforms import ARM, Constant, Equation, Source, Term, product

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TaskGraph:
    """Immutable; teaching and reading give a new one."""

    transforms: Mapping[str, Source]
    positions: Mapping[str, Equation]  # each names T6 once
    relations: tuple[Equation, ...] = ()
    _known: Mapping[str, Source] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """TaskError for names that are not there, and positions without one T6."""
        for equation in (*self.positions.values(), *self.relations):
            strangers = sorted(equation.names - self.transforms.keys() - {ARM})
            if strangers:
                raise TaskError(f"{equation}: {', '.join(strangers)} is not among the transforms of the task")
        for equation in self.positions.values():
            equation.equal_to(ARM)
        for equation in self.relations:
            if ARM in equation.names:
                raise TaskError(f"relation {equation}: {ARM} differs from place to place; make it a position")
        object.__setattr__(self, "_known", self._followed())

    def value(self, name: str, s_m: float = 0.0) -> Floats:
        """(4, 4) of a transform with the belt at s. TaskError where the graph does not determine it."""
        T = self._source(name).at(s_m)
        if T is None:
            raise TaskError(self._why_missing(name))
        return T

    def solve(self, position: str, unknown: str, T6: Floats | None = None, s_m: float = 0.0) -> Floats:
        """(4, 4) of any one transform of a position's equation, the arm standing at T6 (4, 4) if it is not T6 itself.

        TaskError: what else is missing; or that T6 is needed.
        """
        equation = self._position(position)
        terms = equation.equal_to(unknown)

        def known(name: str) -> Floats:
            if name != ARM:
                return self.value(name, s_m)
            if T6 is None:
                raise TaskError(f"{position}, {equation}: solving for {unknown} needs {ARM}, where the arm stands")
            return T6

        missing = [t.name for t in terms if t.name != ARM and self._source(t.name).at(s_m) is None]
        if missing:
            reasons = "; ".join(self._why_missing(name) for name in dict.fromkeys(missing))
            raise TaskError(f"{position}, {equation}: {unknown} is not determined, because {reasons}")
        return product(terms, known)

    def with_value(self, name: str, T: Floats) -> "TaskGraph":
        """The task with a transform known: taught, or read by a camera."""
        if name not in self.transforms:
            raise TaskError(f"{name} is not among the transforms of the task; they are {', '.join(self.transforms)}")
        return replace(self, transforms={**self.transforms, name: Constant(T)})

    def taught(self, unknown: str, position: str, T6: Floats, s_m: float = 0.0) -> "TaskGraph":
        """The arm itself as the measuring tool: it stands at a position, and one transform follows from T6."""
        if self._source(unknown).moves:
            raise TaskError(f"{unknown} moves with the belt and cannot be taught at one place")
        return self.with_value(unknown, self.solve(position, unknown, T6, s_m))

    def place(self, position: str) -> Place:
        """The position as T6 TOOL = COORD(s) POS. TaskError where it is not determined."""
        equation = self._position(position)
        self.solve(position, ARM)  # reports what is missing
        behind = _behind_arm(equation)
        wanted = _reduced((*equation.equal_to(ARM), *behind))  # T6 TOOL
        last = max((i for i, t in enumerate(wanted) if self._source(t.name).moves), default=-1)
        carrying, still = wanted[: last + 1], product(wanted[last + 1 :], self.value)
        tool = product(behind, self.value)
        if not carrying:
            return Place(position, still, tool)
        return Place(position, still, tool, lambda s_m: product(carrying, lambda name: self.value(name, s_m)))

    def check(self, tolerance_m: float = 1e-6, tolerance_rad: float = 1e-6, s_m: float = 0.0) -> None:
        """TaskError naming the first relation whose transforms are all known and do not close, and by how much."""
        for relation in self.relations:
            if any(self._source(name).at(s_m) is None for name in relation.names):
                continue
            off_m, off_rad = apart(
                product(relation.left, lambda n: self.value(n, s_m)),
                product(relation.right, lambda n: self.value(n, s_m)),
            )
            if off_m > tolerance_m or off_rad > tolerance_rad:
                raise TaskError(
                    f"{relation}: this loop does not close, by {1e3 * off_m:.3f} mm and {1e3 * off_rad:.3f} mrad; "
                    "teach or read one of its transforms again"
                )

    def _followed(self) -> dict[str, Source]:
        """The transforms, and those that follow from them by the relations, one equation after the other."""
        known = dict(self.transforms)
        found = True
        while found:
            found = False
            for relation in self.relations:
                missing = [name for name in relation.names if known[name].at(0.0) is None]
                if len(missing) == 1 and not any(known[name].moves for name in relation.names):
                    terms = relation.equal_to(missing[0])
                    known[missing[0]] = Constant(product(terms, lambda name: _sure(known[name])))
                    found = True
        return known

    def _why_missing(self, name: str) -> str:
        why = f"{name} is missing ({self._source(name).why_unknown})"
        through = [str(relation) for relation in self.relations if name in relation.names]
        others = [self._other_unknowns(relation, name) for relation in self.relations if name in relation.names]
        if not through:
            return why
        return why + "".join(
            f", {r} would give it with {' and '.join(o)}" for r, o in zip(through, others, strict=True)
        )

    def _other_unknowns(self, relation: Equation, name: str) -> list[str]:
        return sorted(n for n in relation.names if n != name and self._source(n).at(0.0) is None)

    def _source(self, name: str) -> Source:
        if name not in self._known:
            raise TaskError(f"{name} is not among the transforms of the task; they are {', '.join(self.transforms)}")
        return self._known[name]

    def _position(self, name: str) -> Equation:
        if name not in self.positions:
            raise TaskError(f"{name} is not among the positions of the task; they are {', '.join(self.positions)}")
        return self.positions[name]


def _sure(source: Source) -> Floats:
    T = source.at(0.0)
    if T is None:
        raise TaskError("a transform that was counted as known is not")
    return T


def _behind_arm(equation: Equation) -> tuple[Term, ...]:
    """TOOL: what follows T6 on its side of the equation. With T6^-1 the side stands turned round: TOOL^-1 T6^-1."""
    side = equation.left if any(t.name == ARM for t in equation.left) else equation.right
    index = [t.name for t in side].index(ARM)
    if side[index].inverted:
        return tuple(t.turned_round for t in reversed(side[:index]))
    return side[index + 1 :]


def _reduced(terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """Neighbours that undo each other cancel: T6 TOOL was written with TOOL^-1 TOOL at its end."""
    out: list[Term] = []
    for term in terms:
        if out and out[-1] == term.turned_round:
            out.pop()
        else:
            out.append(term)
    return tuple(out)
