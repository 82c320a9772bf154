"""The errors of an arm: `errors.toml` (docs/error-simulation.md), kinds of errors, and the priors of the rig file.

A new kind is one line of the table of kinds. Link i is the fixed part in front of joint i + 1, the last link that
behind all joints. Encoder eccentricity: a disc off its shaft by e at radius r reads e / r sin(q + f) too much;
graduation: order k of the disc's division. Runout: the axis itself moves on a circle (radial), to and fro (axial), or
on a cone (wobble). Sources: Slocum, Precision Machine Design, 1992, ch. 2.3 and 7 (axis of rotation errors: radial,
axial, tilt); Huang Kui et al. (six errors a link, angle errors of the joints).

Priors: [tolerance] of every link (length_m, angle_rad) and joint zero (angle_rad), joint_rad of [noise] for a reading,
encoder_counts of a joint as its quantisation. Eccentricity, graduation, runout and heat only as the plan states them.
"""

import difflib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Literal

import numpy as np
from msgspec import Struct

from acquisition.recording.files import KeyPath, parse_toml, read_text, shown
from acquisition.recording.files.bounds import (
    Expansion,
    Few,
    Kelvin,
    KelvinOrNone,
    Metres,
    MetresOrNone,
    Name,
    Number,
    Order,
    PerJoint,
    Radians,
    RadiansOrNone,
)
from acquisition.recording.rig import Rig
from calibrate.error_simulation.machine import Machine, slot
from calibrate.error_simulation.sources import (
    ErrorSource,
    Law,
    SourceTerm,
    Wave,
)
from calibrate.errors import DataError

SUFFIX = {"m": "_m", "rad": "_rad", "K": "_k"}


class SourceEntry(Struct, frozen=True, forbid_unknown_fields=True):
    """One [[source]]: names or shell patterns of them, a law, its size in the unit of the source."""

    what: Few[Name]
    law: Name = "normal"
    shape: PerJoint[Number] = ()
    scale_m: MetresOrNone | None = None
    scale_rad: RadiansOrNone | None = None
    scale_k: KelvinOrNone | None = None
    loc_m: Metres | None = None
    loc_rad: Radians | None = None
    loc_k: Kelvin | None = None
    order: Order | None = None  # of waves, cycles a turn

    def law_in(self, unit: str) -> Law:
        """Its law for sources of a unit. DataError where the size is not in this unit."""
        suffix = SUFFIX[unit]
        scale, loc = getattr(self, f"scale{suffix}"), getattr(self, f"loc{suffix}")
        if scale is None:
            raise DataError(
                f"source {shown(', '.join(self.what))}: no scale{suffix}, but this error is in {unit}; give it"
            )
        return Law(self.law, scale, loc or 0.0, self.shape)


class ErrorPlan(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole file; a later entry wins over an earlier one."""

    schema: Literal[1]
    source: Few[SourceEntry]
    expansion_per_k: Expansion | None = None  # of the links' material; heat needs it
    believed: bool = True  # whether what the rig file assumes stands beside it


NOTHING_STATED = ErrorPlan(schema=1, source=())


def read_error_plan(path: Path) -> ErrorPlan:
    """The plan of a file. DataError naming file, line, key, value and remedy."""
    file = parse_toml(read_text(path, "error plan", DataError), str(path), DataError)
    plan = file.checked(ErrorPlan)
    for place, says in _contradictions(plan):
        raise file.error(place, says)
    return plan


def _contradictions(plan: ErrorPlan) -> Iterator[tuple[KeyPath, str]]:
    for i, entry in enumerate(plan.source):
        stated = [s for s in SUFFIX.values() if getattr(entry, f"scale{s}") is not None]
        if len(stated) != 1:
            yield ("source", i), "a source wants one of scale_m, scale_rad, scale_k; give the one of its unit"
            continue
        for suffix in SUFFIX.values():
            if suffix != stated[0] and getattr(entry, f"loc{suffix}") is not None:
                yield ("source", i, f"loc{suffix}"), f"loc{suffix} beside scale{stated[0]}; give loc{stated[0]}"
        try:
            entry.law_in(next(unit for unit, s in SUFFIX.items() if s == stated[0]))
        except DataError as error:
            yield ("source", i), str(error)


ANGLE = 6  # component of a joint's angle
LENGTHS, ANGLES = "link lengths", "link angles"
Terms = Callable[[Machine, int, float], tuple[SourceTerm, ...]]


@dataclass(frozen=True)
class ErrorKind:
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
    kind: ErrorKind
    index: int  # of the part, or of the joint from 0

    def terms(self, machine: Machine, order: float | None) -> tuple[SourceTerm, ...]:
        """Where it acts."""
        return self.kind.terms(machine, self.index, self.kind.order if order is None else order)


def _part(component: int) -> Terms:
    return lambda machine, part, order: (SourceTerm(slot(part, component)),)


def _angle(machine: Machine, joint: int, order: float) -> tuple[SourceTerm, ...]:
    return (SourceTerm(slot(joint, ANGLE)),)


def _angle_wave(machine: Machine, joint: int, order: float) -> tuple[SourceTerm, ...]:
    return (SourceTerm(slot(joint, ANGLE), wave=Wave(joint, order)),)


def _axial(machine: Machine, joint: int, order: float) -> tuple[SourceTerm, ...]:
    return (SourceTerm(slot(joint, 2), wave=Wave(joint, order)),)


def _circle(first: int) -> Terms:
    """Components `first`, the next one: cosine and sine."""
    return lambda machine, joint, order: (
        SourceTerm(slot(joint, first), wave=Wave(joint, order, cosine=True)),
        SourceTerm(slot(joint, first + 1), wave=Wave(joint, order)),
    )


def _growth(machine: Machine, part: int, order: float) -> tuple[SourceTerm, ...]:
    """Of one fixed part along itself, for one unit of strain; seen in the frame behind it. The flange's probe, too."""
    length = machine.fixed[part, :3, :3].T @ machine.fixed[part, :3, 3]
    if part == machine.n_joints:
        length = length + machine.point_m
    return tuple(SourceTerm(slot(part, axis), weight=float(x)) for axis, x in enumerate(length) if abs(x) > 0.0)


def _growth_of_all(machine: Machine, index: int, order: float) -> tuple[SourceTerm, ...]:
    return tuple(term for part in range(machine.n_joints + 1) for term in _growth(machine, part, order))


KINDS = (
    *(ErrorKind("link", axis, LENGTHS, "m", _part(i)) for i, axis in enumerate(("x", "y", "z"))),
    *(ErrorKind("link", axis, ANGLES, "rad", _part(3 + i)) for i, axis in enumerate(("roll", "pitch", "yaw"))),
    ErrorKind("joint", "zero", "joint zeros", "rad", _angle),
    ErrorKind("joint", "noise", "reading noise", "rad", _angle),
    ErrorKind("joint", "quantisation", "quantisation", "rad", _angle),
    ErrorKind("joint", "eccentricity", "encoder eccentricity", "rad", _angle_wave),
    ErrorKind("joint", "graduation", "encoder graduation", "rad", _angle_wave, order=2.0, ordered=True),
    ErrorKind("joint", "runout-radial", "joint runout", "m", _circle(0), ordered=True),
    ErrorKind("joint", "runout-axial", "joint runout", "m", _axial, ordered=True),
    ErrorKind("joint", "wobble", "axis wobble", "rad", _circle(3), ordered=True),
    ErrorKind("heat", "arm", "heat", "K", _growth_of_all),
    ErrorKind("heat", "link", "heat", "K", _growth),
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


HEAT = "K"


def sources_of(
    machine: Machine,
    rig: Rig,
    plan: ErrorPlan = NOTHING_STATED,
    only: tuple[str, ...] = (),
    *,
    identified: bool = False,
) -> tuple[ErrorSource, ...]:
    """Of `only` these patterns, where there are any. `identified`: links and zeros are no longer off nominal.

    DataError where a pattern matches nothing, where heat has no expansion, and where no source is left.
    """
    every = {p.name: p for p in possible(machine)}
    laws = dict(_assumed_laws(rig, every.values(), identified=identified)) if plan.believed else {}
    orders: dict[str, float | None] = {}
    for entry in plan.source:
        for one in _matching(entry, every):
            laws[one.name] = entry.law_in(one.kind.unit)
            orders[one.name] = entry.order
    chosen = [name for name in every if name in laws and laws[name].square > 0.0 and _asked(name, only)]
    if not chosen:
        raise DataError(
            f"rig {rig.name}: no error to simulate; state [tolerance], [noise] joint_rad or encoder_counts in the rig, "
            "give --errors, or widen --only"
        )
    return tuple(_source(machine, every[name], laws[name], orders.get(name), plan) for name in chosen)


def _source(machine: Machine, one: Possible, law: Law, order: float | None, plan: ErrorPlan) -> ErrorSource:
    if order is not None and not one.kind.ordered:
        raise DataError(f"source {one.name}: it has no order; leave order = {order:g} out")
    terms = one.terms(machine, order)
    if one.kind.unit == HEAT:
        if plan.expansion_per_k is None:
            raise DataError(f"source {one.name}: heat needs expansion_per_k of the links' material; state it")
        terms = tuple(SourceTerm(t.slot, t.weight * plan.expansion_per_k) for t in terms)
    return ErrorSource(one.name, one.kind.group, one.kind.unit, law, terms)


def _assumed_laws(rig: Rig, every: Iterable[Possible], *, identified: bool) -> Iterator[tuple[str, Law]]:
    for one in every:
        law = _assumed_law(rig, one, identified=identified)
        if law is not None:
            yield one.name, law


def _assumed_law(rig: Rig, one: Possible, *, identified: bool) -> Law | None:
    tolerance, group, word = rig.tolerance, one.kind.group, one.kind.word
    if tolerance is not None and not identified and (group in (LENGTHS, ANGLES) or word == "zero"):
        return Law("normal", tolerance.length_m if group == LENGTHS else tolerance.angle_rad)
    if word == "noise" and rig.noise.joint_rad is not None:
        return Law("normal", rig.noise.joint_rad)
    counts = rig.arm.joints[one.index].encoder_counts if word == "quantisation" else None
    return None if counts is None else Law("uniform", half_step_rad(counts))


def _matching(entry: SourceEntry, every: dict[str, Possible]) -> list[Possible]:
    out: list[Possible] = []
    for pattern in entry.what:
        found = [one for name, one in every.items() if fnmatchcase(name, pattern)]
        if not found:
            near = difflib.get_close_matches(pattern, every, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(every)}"
            raise DataError(f"error plan: no source of this arm matches '{pattern}'; {hint}")
        out.extend(found)
    return out


def _asked(name: str, only: tuple[str, ...]) -> bool:
    return not only or any(fnmatchcase(name, pattern) for pattern in only)
