r"""Configurations of robtargets [cf1, cf4, cf6, cfx]: in which quarters axes stand, and where they are not observed.

Source: ABB, RAPID reference manual, confdata, ConfJ, ConfL: behind `ConfJ \Off` or `ConfL \Off` a move goes to the
posture nearest to the one before it, whatever its target states; a program begins with both on.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.apply.correct.corrected import Branch
from calibrate.apply.programs import literal
from calibrate.apply.programs.stated_frames import Event, routines_of, set_above

Floats = NDArray[np.float64]
Observed = Callable[[literal.Move], literal.NamedPose]  # named ON or OFF, or refused

LINES = re.IGNORECASE | re.MULTILINE
QUARTER = np.pi / 2.0
CF = ((0, 0), (1, 3), (2, 5))  # entry of confdata, joint from 0
ON, OFF = literal.NamedPose("on"), literal.NamedPose("off")
CONF = re.compile(r"\bConf(?P<way>[JL])\b\s*(?:\\\s*(?P<state>On|Off)\b)?", re.IGNORECASE)
WAY_OF_MOVE = re.compile(r"\b(?:Move|Arc|Cap|Cut|Disp|Paint|Spot|Trigg)(?P<way>[JLC])", re.IGNORECASE)
ROUTINE = re.compile(r"\b(?:PROC|FUNC\s+\w+|TRAP|RECORD)\s+(?P<name>\w+)\s*(?P<parameters>(?:\([^)]*)?)", re.IGNORECASE)
WAY = re.compile(
    r"\b(?:(?P<while>WHILE\b[^;]*?\bDO)|(?P<loop>FOR\b[^;]*?\bDO)|(?P<if>(?<!END)IF\b[^;]*?\bTHEN)"
    r"|(?P<switch>TEST\s[^;\n]*)|(?P<else>CASE|ELSEIF)|(?P<otherwise>ELSE|DEFAULT)|(?P<return>RETURN\b[^;]*)"
    r"|(?P<end>END(?:FOR|WHILE|TEST|IF|PROC|FUNC|TRAP|RECORD)))\b",
    LINES,
)
SHORT_IF = re.compile(r"\bIF\b(?:(?!\bTHEN\b)[^;])*;", re.IGNORECASE)  # for one instruction only
JUMP = re.compile(r"\bGOTO\s+(?P<goto>\w+)|^[ \t]*(?P<label>[A-Z]\w*)[ \t]*:(?!=)", LINES)


def quarters(confdata: Sequence[tuple[literal.Span, float]]) -> tuple[Branch, literal.Turns]:
    """Whether joint angles (posture, joint) stand as stated, and the entries that change with a joint.

    An angle on the edge of two quarters may be written as either.
    """

    def within(q_rad: Floats, k: int) -> NDArray[np.bool_]:
        begin_rad = QUARTER * confdata[k][1]
        return (q_rad >= begin_rad - literal.EDGE_RAD) & (q_rad <= begin_rad + QUARTER + literal.EDGE_RAD)

    def asked(q_rad: Floats) -> NDArray[np.bool_]:
        return np.asarray(np.all([within(q_rad[:, j], k) for k, j in CF], axis=0), dtype=np.bool_)

    def turns(q_rad: Floats) -> list[tuple[literal.Span, str]]:
        return [(confdata[k][0], f"{np.floor(q_rad[j] / QUARTER):.0f}") for k, j in CF if not within(q_rad[j], k)]

    return asked, turns


def as_observed(one: literal.Literal, observed: Observed) -> literal.Literal:
    """A target without its configuration, where no move to it observes that; refused where it is not known."""
    if one.branch is None or not one.moves:
        return one
    states = [observed(move) for move in one.moves]
    if refused := next((state for state in states if state.refused), None):
        return replace(one, own=(refused, one.moves[0].tool))
    return replace(one, branch=None, turns=None) if all(state.name == OFF.name for state in states) else one


def observed_along(code: str, calls: Iterable[re.Match[str]]) -> Observed:
    """Of each move of a module, whether the controller observes configurations there. `calls`: all statements."""
    sets = list(CONF.finditer(code))
    if not sets:
        return lambda move: ON
    events = routines_of(code, ROUTINE, WAY)
    names = {event.name for event in events if event.kind == "routine"}
    events += [Event(m.end(), "call", m["name"].lower()) for m in calls if m["name"].lower() in names]
    events += [Event(m.start(), m.lastgroup or "", (m["goto"] or m["label"]).lower()) for m in JUMP.finditer(code)]
    for match in SHORT_IF.finditer(code):
        if CONF.search(match.group()):
            events += [Event(match.start(), "if"), Event(match.end(), "end")]

    def along(way: str) -> Callable[[int], literal.NamedPose]:
        own = [m for m in sets if m["way"].upper() == way]
        changes = [Event(m.end(), "set", "", OFF if (m["state"] or "").upper() == "OFF" else ON) for m in own]
        return set_above([*events, *changes], ON, f"observation of configurations (Conf{way})")

    at = {way: along(way) for way in "JL"}

    def observed(move: literal.Move) -> literal.NamedPose:
        match = WAY_OF_MOVE.search(move.text)
        way = "J" if match is not None and match["way"].upper() == "J" else "L"
        return at[way](move.line_start + len(move.text))

    return observed
