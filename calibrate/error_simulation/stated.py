"""The sources of a machine: what its rig file believes, then what a plan states; nothing is made up.

Beliefs: [tolerance] about every link (length_m, angle_rad) and joint zero (angle_rad), joint_rad of [noise] about a
reading, encoder_counts of a joint as its quantisation. Eccentricity, graduation, runout and heat only as stated.
"""

import difflib
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase

from acquisition.recording.rig import Rig
from calibrate.error_simulation.error_plan import ANGLES, LENGTHS, Possible, half_step_rad, possible
from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.plan import NOTHING_STATED, ErrorPlan, SourceEntry
from calibrate.error_simulation.source import Source, Term
from calibrate.error_simulation.sources import Law
from calibrate.errors import DataError

HEAT = "K"


def sources_of(
    machine: Machine,
    rig: Rig,
    plan: ErrorPlan = NOTHING_STATED,
    only: tuple[str, ...] = (),
    *,
    identified: bool = False,
) -> tuple[Source, ...]:
    """Of `only` these patterns, where there are any. `identified`: links and zeros are no longer off as drawn.

    DataError where a pattern matches nothing, where heat has no expansion, and where no source is left.
    """
    every = {p.name: p for p in possible(machine)}
    laws = dict(_believed(rig, every.values(), identified=identified)) if plan.believed else {}
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


def _source(machine: Machine, one: Possible, law: Law, order: float | None, plan: ErrorPlan) -> Source:
    if order is not None and not one.kind.ordered:
        raise DataError(f"source {one.name}: it has no order; leave order = {order:g} out")
    terms = one.terms(machine, order)
    if one.kind.unit == HEAT:
        if plan.expansion_per_k is None:
            raise DataError(f"source {one.name}: heat needs expansion_per_k of the links' material; state it")
        terms = tuple(Term(t.slot, t.weight * plan.expansion_per_k) for t in terms)
    return Source(one.name, one.kind.group, one.kind.unit, law, terms)


def _believed(rig: Rig, every: Iterable[Possible], *, identified: bool) -> Iterator[tuple[str, Law]]:
    for one in every:
        law = _belief(rig, one, identified=identified)
        if law is not None:
            yield one.name, law


def _belief(rig: Rig, one: Possible, *, identified: bool) -> Law | None:
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
