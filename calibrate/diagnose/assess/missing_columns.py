"""Findings that change along the session: what they really follow may be a column that was not recorded.

A warm-up and a cooling room are both smooth in time, and a load that is seldom changed resembles time to whoever does
not know it. The name of such a drift has an alternative that this record cannot hold.

What the scatter of a driver that was not recorded would resemble at each port: how far the readings follow it.

A hidden direction of approach turns one joint the same amount either way, a hidden payload by its lever, a hidden speed
all joints at once, a hidden current of a detector pulls spots towards where foreign light falls.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess.diagnosis import (
    NOT_FINAL,
    UNKNOWN,
    Finding,
    Named,
    Unexplained,
)
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.port_process import TIME, lever, places_of
from calibrate.model.effects.curve import (
    is_slow_cause,
)
from calibrate.model.effects.gravity import payload_levers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Missing, Shape

SMOOTH = (Shape.EXPONENTIAL.value, Shape.LINEAR.value, Shape.SMOOTH.value)  # a step is no matter of warmth
WARMTH, LOAD = "temp", "payload"  # drivers
ROOM = "temp_room_degC"


def suspects(name: Named, missing: Sequence[Missing]) -> tuple[Missing, ...]:
    """Columns, not in the record, that a cause may really follow; none for what does not drift."""
    out: list[Missing] = []
    if name.depends_on == ("t",) and name.shape in SMOOTH:
        out += _thermometers(name.where, [m for m in missing if m.driver == WARMTH])
    if name.physics == UNKNOWN and all(map(is_slow_cause, name.depends_on)):
        out += [m for m in missing if m.driver == LOAD][:1]
    return tuple(out)


def separated_by_time(one: Named, other: Named) -> bool:
    """Whether two names differ in what they follow along the session only: no pose separates them."""
    return one.where == other.where and all(map(is_slow_cause, (*one.depends_on, *other.depends_on)))


def not_final_drift(finding: Finding) -> Finding:
    """A drift whose name is not final."""
    if finding.name.physics == UNKNOWN:
        return finding
    return finding.weakened(NOT_FINAL / max(finding.confidence, NOT_FINAL))


def drift_not_determined(finding: Finding, lacking: Sequence[Missing]) -> Unexplained:
    """What cannot be determined of a drift, and the columns that would show it."""
    columns = ", ".join(dict.fromkeys(m.column for m in lacking))
    why = f"it changes along the session, and what it follows cannot be determined; missing column: {columns}"
    drivers = tuple(dict.fromkeys(m.driver for m in lacking))
    return Unexplained(finding.name.where, drivers, finding.share, finding.p, why)


def _thermometers(where: str, warmth: Sequence[Missing]) -> list[Missing]:
    """By the columns of samples.csv: at the part that drifts, if it is one that warms itself, and in the room."""
    if not warmth:
        return []
    part = where.split(".")[0]
    part = f"link{part.removeprefix('joint')}" if part.startswith("joint") else part
    columns = (f"temp_{part}_degC", ROOM) if part.startswith(("link", "laser")) else (ROOM,)
    physics = next((m.physics for m in warmth if m.physics.startswith(part)), warmth[0].physics)
    return [Missing(WARMTH, column, physics) for column in columns]


Floats = NDArray[np.float64]

SPOT_PAIR = 2  # coordinates of one detector


@dataclass(frozen=True, eq=False)
class Wish:
    """A port that might want a random value at every sample."""

    port: Port
    levers: Floats  # (lever, row) independent random values and how the rows follow each
    missing: tuple[Missing, ...] = ()  # columns, not in the record, that would do this


def wishes(bench: Bench, missing: Sequence[Missing] = ()) -> tuple[Wish, ...]:
    """Every port by itself, and what each column that is missing would do to it."""
    felt = {(port, component): lever(bench, port, component) for port, component in places_of(bench)}
    out = [_alone(port, rows, missing) for (port, _), rows in felt.items()]
    for kind in KINDS:
        out += kind(bench, felt, missing)
    return tuple(out)


Felt = dict[tuple[Port, int], Floats]
Kind = Callable[[Bench, Felt, Sequence[Missing]], list[Wish]]
AT_ONE_JOINT = ("approach", "cmd_minus_q")  # drivers that turn a joint by the same amount in any pose


def _alone(port: Port, felt: Floats, missing: Sequence[Missing]) -> Wish:
    fitting = tuple(m for m in missing if m.driver in AT_ONE_JOINT) if port.place is Place.JOINTS else ()
    return Wish(port, felt[None], fitting)


def _payload(bench: Bench, felt: Felt, missing: Sequence[Missing]) -> list[Wish]:
    fitting = tuple(m for m in missing if m.driver == "payload")
    sample = np.maximum(bench.state.rows.sample, 0)
    out: list[Wish] = []
    for (port, component), rows in felt.items():
        if fitting and port.place is Place.JOINTS:
            torque = payload_levers(bench.state.drivers, component + 1)[:, 0]
            out.append(Wish(port, (rows * torque[sample])[None], fitting))
    return out


def _speed(bench: Bench, felt: Felt, missing: Sequence[Missing]) -> list[Wish]:
    joints = [rows for (port, _), rows in felt.items() if port.place is Place.JOINTS]
    if len(joints) < 2:
        return []
    return [Wish(Port(TIME, Place.JOINTS), np.stack(joints), tuple(m for m in missing if m.driver == "qd"))]


def _current(bench: Bench, felt: Felt, missing: Sequence[Missing]) -> list[Wish]:
    """Spots pulled along the line to the middle of their detector."""
    fitting = tuple(m for m in missing if m.driver == "psd1_sum")
    sample = np.maximum(bench.state.rows.sample, 0)
    ports = {port.where: port for port, _ in felt if port.place is Place.READING} if fitting else {}
    out: list[Wish] = []
    for port in ports.values():
        spots = np.nan_to_num(bench.state.drivers.readouts[port.instrument].predicted)
        both = [c for p, c in felt if p == port]
        if len(both) == SPOT_PAIR:
            pull = np.sum([felt[port, c] * spots[sample, c] for c in both], axis=0)
            out.append(Wish(port, pull[None], fitting))
    return out


KINDS: tuple[Kind, ...] = (_payload, _speed, _current)
