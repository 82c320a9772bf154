"""Findings that change along the session: what they really follow may be a column that was not recorded.

A warm-up and a cooling room are both smooth in time, and a load that is seldom changed resembles time to whoever does
not know it. The name of such a drift has an alternative that this record cannot hold.
"""

from collections.abc import Sequence

from calibrate.diagnose.doubts.diagnosis import (
    NOT_FINAL,
    UNKNOWN,
    Finding,
    Named,
    Unexplained,
)
from calibrate.model.effects.curve import is_slow_cause
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


def parted_by_time(one: Named, other: Named) -> bool:
    """Whether two names differ in what they follow along the session only: no pose separates them."""
    return one.where == other.where and all(map(is_slow_cause, (*one.depends_on, *other.depends_on)))


def doubtful(finding: Finding) -> Finding:
    """A drift whose name is not final."""
    if finding.name.physics == UNKNOWN:
        return finding
    return finding.believed(NOT_FINAL / max(finding.confidence, NOT_FINAL))


def untold(finding: Finding, lacking: Sequence[Missing]) -> Unexplained:
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
