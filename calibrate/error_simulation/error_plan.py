"""The kinds of sources: which there are at links, at joints and of heat, what they do, and in which unit.

A new kind is one line here. Link i is the fixed part in front of joint i + 1, the last link that behind all joints.
Encoder eccentricity: a disc off its shaft by e at radius r reads e / r sin(q + f) too much; graduation: order k of the
disc's division. Runout: the axis itself moves on a circle (radial), to and fro (axial), or on a cone (wobble).
Sources: Slocum, Precision Machine Design, 1992, ch. 2.3 and 7 (axis of rotation errors: radial, axial, tilt); mission
of Huang Kui et al. (six errors a link, angle errors of the joints).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from calibrate.error_simulation.machine import Machine, slot
from calibrate.error_simulation.source import Term, Wave

ANGLE = 6  # component of a joint's angle
LENGTHS, ANGLES = "link lengths", "link angles"
Terms = Callable[[Machine, int, float], tuple[Term, ...]]


@dataclass(frozen=True)
class Kind:
    """One kind at one place. `terms` of (machine, index of the place, order)."""

    place: str  # "link": parts 0 ... n; "joint": joints 1 ... n; "heat": the arm, then links
    word: str
    group: str
    unit: str
    terms: Terms
    order: float = 1.0  # of its wave, where none is stated
    ordered: bool = False  # whether an order may be stated


@dataclass(frozen=True)
class Possible:
    """A source that the machine may have, before its size is stated."""

    name: str
    kind: Kind
    index: int  # of the part, or of the joint from 0

    def terms(self, machine: Machine, order: float | None) -> tuple[Term, ...]:
        """Where it acts."""
        return self.kind.terms(machine, self.index, self.kind.order if order is None else order)


def _part(component: int) -> Terms:
    return lambda machine, part, order: (Term(slot(part, component)),)


def _angle(machine: Machine, joint: int, order: float) -> tuple[Term, ...]:
    return (Term(slot(joint, ANGLE)),)


def _angle_wave(machine: Machine, joint: int, order: float) -> tuple[Term, ...]:
    return (Term(slot(joint, ANGLE), wave=Wave(joint, order)),)


def _axial(machine: Machine, joint: int, order: float) -> tuple[Term, ...]:
    return (Term(slot(joint, 2), wave=Wave(joint, order)),)


def _circle(first: int) -> Terms:
    """Components `first`, the next one: cosine and sine."""
    return lambda machine, joint, order: (
        Term(slot(joint, first), wave=Wave(joint, order, cosine=True)),
        Term(slot(joint, first + 1), wave=Wave(joint, order)),
    )


def _growth(machine: Machine, part: int, order: float) -> tuple[Term, ...]:
    """Of one fixed part along itself, for one unit of strain; seen in the frame behind it. The flange's probe, too."""
    length = machine.fixed[part, :3, :3].T @ machine.fixed[part, :3, 3]
    if part == machine.n_joints:
        length = length + machine.point_m
    return tuple(Term(slot(part, axis), weight=float(x)) for axis, x in enumerate(length) if abs(x) > 0.0)


def _growth_of_all(machine: Machine, index: int, order: float) -> tuple[Term, ...]:
    return tuple(term for part in range(machine.n_joints + 1) for term in _growth(machine, part, order))


KINDS = (
    *(Kind("link", axis, LENGTHS, "m", _part(i)) for i, axis in enumerate(("x", "y", "z"))),
    *(Kind("link", axis, ANGLES, "rad", _part(3 + i)) for i, axis in enumerate(("roll", "pitch", "yaw"))),
    Kind("joint", "zero", "joint zeros", "rad", _angle),
    Kind("joint", "noise", "reading noise", "rad", _angle),
    Kind("joint", "quantisation", "quantisation", "rad", _angle),
    Kind("joint", "eccentricity", "encoder eccentricity", "rad", _angle_wave),
    Kind("joint", "graduation", "encoder graduation", "rad", _angle_wave, order=2.0, ordered=True),
    Kind("joint", "runout-radial", "joint runout", "m", _circle(0), ordered=True),
    Kind("joint", "runout-axial", "joint runout", "m", _axial, ordered=True),
    Kind("joint", "wobble", "axis wobble", "rad", _circle(3), ordered=True),
    Kind("heat", "arm", "heat", "K", _growth_of_all),
    Kind("heat", "link", "heat", "K", _growth),
)


def possible(machine: Machine) -> Iterator[Possible]:
    """Every source that this machine may have, in the order of KINDS. Parts without a length cannot grow."""
    for kind in KINDS:
        if kind.place == "link":
            yield from (Possible(f"link{i}.{kind.word}", kind, i) for i in range(machine.n_joints + 1))
        elif kind.place == "joint":
            yield from (Possible(f"joint{i + 1}.{kind.word}", kind, i) for i in range(machine.n_joints))
        elif kind.word == "arm":
            yield Possible("heat.arm", kind, 0)
        else:
            long = [i for i in range(machine.n_joints + 1) if len(_growth(machine, i, 1.0))]
            yield from (Possible(f"heat.link{i}", kind, i) for i in long)


def half_step_rad(counts: int) -> float:
    """Largest rounding of an encoder with so many counts a turn."""
    return float(np.pi / counts)
