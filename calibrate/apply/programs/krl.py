"""KRL of KUKA: aggregates {X .., Y .., Z .., A .., B .., C .., S .., T ..} and {A1 .., ... A6 ..}; mm and degrees.

A, B, C turn about z, y, x. Bit n of T is set where axis n + 1 stands below 0 degrees: it fixes the posture. Taken are
targets of PTP, LIN, SPTP, SLIN, SPL and declared points; tools, bases and relative moves are none.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from calibrate.apply.correct.corrected import Branch
from calibrate.apply.correct.rotations import KUKA
from calibrate.apply.programs import literal
from calibrate.apply.programs.stated_frames import (
    Event,
    Used,
    alike,
    routines_of,
    set_above,
    words_of,
)

Floats = NDArray[np.float64]

LINES = re.IGNORECASE | re.MULTILINE
AGGREGATE = r"\{(?:\s*(?:E6POS|E6AXIS|POS|AXIS|FRAME)\s*:)?(?P<fields>[^{}\[\]]*)\}"
FIELD = re.compile(rf"\b(?P<key>[A-Z]\w*)\s+(?P<number>{literal.NUMBER}|'B[01]+')(?=\s*(?:[,}}]|$))", re.IGNORECASE)
EXTERNAL = re.compile(r"\b(?P<name>E[1-6])\s+(?P<value>[^\s,}][^,}]*)", re.IGNORECASE)
NAME = r"[A-Za-z_]\w*(?:\[[^\]]*\])?"
GOES = r"^[ \t]*(?:S?(?:PTP|LIN|CIRC)|SPL)"
# Geometric operators make another target of a point.
ONE = rf"(?:{NAME}|\{{[^{{}}]*\}})"
TIMES = rf"(?:[ \t]*:[ \t]*{ONE})*"
INLINE = re.compile(rf"{GOES}\s+{AGGREGATE}(?!\s*:)", LINES)
# An arc has two targets: the auxiliary point, and its end.
ARC = rf"^[ \t]*S?CIRC\s+{ONE}{TIMES}\s*,\s*"
INLINE_END = re.compile(rf"{ARC}{AGGREGATE}(?!\s*:)", LINES)
ARRAY = re.compile(r"\b(?:E6POS|E6AXIS|POS|AXIS)\s+(?P<name>\w+)\s*\[", re.IGNORECASE)
ELEMENT = re.compile(rf"^[ \t]*(?P<name>(?P<array>\w+)\s*\[\s*\d+\s*\])\s*=\s*{AGGREGATE}", LINES)
DECLARED = re.compile(
    rf"^[ \t]*(?:DECL\s+)?(?:GLOBAL\s+)?(?:CONST\s+)?(?P<type>E6POS|E6AXIS|POS|AXIS|FRAME)\s+(?P<name>\w+)\s*="
    rf"\s*{AGGREGATE}",
    LINES,
)
TARGET = rf"(?P<target>\{{|{NAME}{TIMES})"
MOVE = re.compile(rf"{GOES}\s+{TARGET}", LINES)
ARC_END = re.compile(rf"{ARC}{TARGET}", LINES)
MOTION = re.compile(
    r"^[ \t]*(?P<go>(?:S?(?:PTP|LIN|CIRC)|SPL)(?:_REL)?)\b(?![ \t]*[=(])(?![ \t]+\$(?:AXIS|POS)_ACT\b)", LINES
)
AXIS_SET = re.compile(r"\w\.(?P<name>E[1-6])[ \t]*=(?!=)[ \t]*(?P<value>[^\n;]*)", re.IGNORECASE)
RELATIVE = re.compile(rf"{GOES}_REL\s+{AGGREGATE}", LINES)
OTHER = re.compile(rf"{GOES}_REL\b", LINES)
ROUTINE = re.compile(r"^[ \t]*(?:GLOBAL\s+)?DEF(?:FCT\s+\w+)?\s+(?P<name>\w+)\s*\((?P<parameters>[^)]*)", LINES)
WAY = re.compile(
    r"^[ \t]*(?:(?P<while>WHILE\b[^\n]*)|(?P<loop>FOR\b[^\n]*|REPEAT|LOOP)|(?P<if>IF\b.*?(?:\bTHEN|$))"
    r"|(?P<switch>SWITCH\b[^\n]*)|(?P<scope>(?:PTP_)?SPLINE)|(?P<else>CASE)|(?P<otherwise>ELSE|DEFAULT)|(?P<break>EXIT)"
    r"|(?P<end>END(?:FOR|WHILE|LOOP|IF|SWITCH|SPLINE|FCT)?|UNTIL\b[^\n]*)|(?P<return>RETURN\b[^\n]*))(?!\w)",
    LINES,
)
JUMP = re.compile(r"\bGOTO[ \t]+(?P<goto>\w+)|^[ \t]*(?P<label>[A-Z]\w*)[ \t]*:", LINES)
SET = re.compile(
    r"\$(?P<what>BASE|TOOL)(?P<part>\.\w+)?[ \t]*=(?!=)[ \t]*(?P<value>(?:\{[^{}\n]*\}|\([^()\n]*\)|[^\n,])*)"
    r"|\bBAS\s*\(\s*#(?P<kind>BASE|TOOL)\s*,\s*(?P<number>\w+)\s*\)|\bFDAT_ACT\s*=\s*(?P<inline>\w+)",
    re.IGNORECASE,
)
WITH = re.compile(rf"{GOES}\b[^\n]*?\bWITH\b[^\n]*", LINES)
HELD = re.compile(rf"(?<!\w)(?P<name>\$?\w+(?:[ \t]*\[[ \t]*\d+[ \t]*\])?)\s*=\s*{AGGREGATE}(?!\s*:)", re.IGNORECASE)
INLINE_DATA = re.compile(r"\bFDAT\s+(?P<name>\w+)\s*=\s*\{(?P<fields>[^{}]*)\}", re.IGNORECASE)
CHANGED = re.compile(r"(?<![\w$.])(?P<name>\$?\w+(?:[ \t]*\[[^\]\n]*\])?)(?:\.\w+)*[ \t]*=(?!=)", re.IGNORECASE)
CHOSEN = re.compile(r"\[(?!\d+\])")  # an index that is no number
INLINE_FORM = re.compile(r"S(?:BASE|TOOL2?)\s*\(\s*(?P<name>\w+)(?:\.(?:BASE|TOOL)_NO)?\s*\)\s*", re.IGNORECASE)
ON_AXES = re.compile(r"EK\s*\(", re.IGNORECASE)  # a base that external axes carry
FIXED = re.compile(r"\$IPO_MODE\s*=\s*#TCP|IPO_FRAME\s+#TCP", re.IGNORECASE)
DATA_LIST = re.compile(r"^[ \t]*DEFDAT\b.*?^[ \t]*ENDDAT\b", LINES | re.DOTALL)
GIVEN = re.compile(rf"[(,][ \t]*(?P<name>{NAME})[ \t]*(?=[,)])", re.IGNORECASE)
CALLED = re.compile(r"(?:^|\bDO)[ \t]*(?P<name>[A-Z]\w*)[ \t]*\(", LINES)
# Statements, and subprograms of the system that leave bases and tools as they are, or are followed (BAS).
BUILT_IN = literal.built_in(r"""
    S?(?:PTP|LIN|CIRC)(?:_REL)? SPL IF WHILE UNTIL SWITCH CASE FOR RETURN WAIT BAS IR_STOPM P00 CHK_HOME
    C(?:OPEN|CLOSE|READ|WRITE|IOCTL) S(?:READ|WRITE) IOCTL CAST_(?:TO|FROM) PULSE ROB_STOP(?:_RELEASE)? VARSTATE
    SET_BRAKE_DELAY DELETE_BACKWARD_BUFFER SUPPRESS_REPOSITIONING VECTORMOVEO(?:N|FF) (?:RE)?SET_TORQUE_LIMITS
    WSPACE(?:GIVE|TAKE) SYNCCMD REMOTE(?:CMD|READ) CANCELPROGSYNC MBX_REC (?:SET|CLEAR|EXISTS)_KRL(?:MSG|DLG)\w*
    MSG(?:NOTIFY?|QUIT|STATE|DIALOG|LOOP) ERR_(?:RAISE|CLEAR) (?:EKI|RSI|ST)_\w+ EB_TEST EO STR(?:ADD|CLEAR|COPY)""")
POSE = ("X", "Y", "Z", "A", "B", "C")


def find(text: str, n_joints: int) -> literal.Targets:
    """Of .src and of .dat."""
    code = literal.blanked(text, ";")
    places, inline_data = _places(code)
    by_name = literal.moves_of(text, code, (MOVE, ARC_END), places)
    arrays = {match["name"].lower() for match in ARRAY.finditer(code)}
    elements = (match for match in ELEMENT.finditer(code) if match["array"].lower() in arrays)
    literals: list[literal.Literal] = []
    skipped: list[str] = []
    external: list[tuple[str, float]] = []
    for match in (*INLINE.finditer(code), *INLINE_END.finditer(code), *DECLARED.finditer(code), *elements):
        inline = match.re in (INLINE, INLINE_END)
        if inline:
            moves = (literal.instruction(text, match.start(), places),)
            name = f"line {literal.line_of(text, match.start('fields'))}"
        else:
            name = match["name"]
            moves = literal.moves_to(by_name, name)
            if match.re is DECLARED and match["type"].upper() == "FRAME" and not moves:
                continue  # a base or a tool
        fdat = "" if inline else "F" + name.upper().removeprefix("X")
        moves = tuple(_move(move, inline_data(fdat, move.line_start)) for move in moves)
        one = _literal(text, match, name, moves, n_joints, None if moves else inline_data(fdat, len(code)))
        external += [] if one else _external(text, match)
        if one is None and not inline:
            why = f"{name}: an aggregate that does not state the whole target is not corrected"
            skipped.append(f"line {literal.line_of(text, match.start('fields'))}: {why}")
        elif one is not None:
            literals.append(one)
    external += [axis for match in RELATIVE.finditer(code) for axis in _external(text, match)]
    external += [_axis(match) for match in AXIS_SET.finditer(code)]
    others = ((m.end(), f"{m.group().strip()}: relative moves are not corrected") for m in OTHER.finditer(code))
    skipped += literal.sentences(code, by_name, literals, CHANGED, others)
    absent = literal.absent(code, CALLED.finditer(code), ROUTINE, BUILT_IN, "sets $BASE or $TOOL")
    return literal.Targets(tuple(sorted(literals, key=lambda one: one.at)), tuple(skipped), absent, tuple(external))


def _move(move: literal.Move, own: Used | None) -> literal.Move:
    """With base and tool of the FDAT of its point where the program names none; where it names others, refused."""
    if own is None or (WITH.match(move.text) and SET.search(move.text)):
        return move

    def settled(place: literal.NamedPose, stated: literal.NamedPose, word: str) -> literal.NamedPose:
        if alike(place, stated) or not (place.name or place.refused):
            return stated
        why = f"the {word} at the move, {place.name}, is not that of the FDAT of its point, {stated.name}"
        return replace(place, refused=place.refused or why)

    return replace(move, frame=settled(move.frame, own[0], "base"), tool=settled(move.tool, own[1], "tool"))


def _literal(
    text: str, match: re.Match[str], name: str, moves: tuple[literal.Move, ...], n_joints: int, own: Used | None
) -> literal.Literal | None:
    begin = match.start("fields")
    fields = _fields(text, *match.span("fields"))
    for keys, joints in ((POSE, False), (tuple(f"A{j + 1}" for j in range(n_joints)), True)):
        if all(key in fields for key in keys):
            branch, turns = (None, None) if joints or "T" not in fields else _turn(*fields["T"])
            spans, values = (tuple(part) for part in zip(*(fields[key] for key in keys), strict=True))
            axes = tuple(_external(text, match))
            return literal.Literal(name, begin, spans, values, joints, moves, branch, turns, own, (), axes)
    return None


def _external(text: str, match: re.Match[str]) -> list[tuple[str, float]]:
    """External axes of an aggregate; NaN for one that is an expression."""
    return [_axis(axis) for axis in EXTERNAL.finditer(text, *match.span("fields"))]


def _axis(match: re.Match[str]) -> tuple[str, float]:
    value = match["value"].strip()
    return match["name"].upper(), float(value) if re.fullmatch(literal.NUMBER, value) else np.nan


def _fields(text: str, begin: int, end: int) -> dict[str, tuple[literal.Span, float]]:
    """Numbers of an aggregate by key; bits may be written as 'B0110'."""
    return {
        field["key"].upper(): (
            field.span("number"),
            float(int(field["number"][2:-1], 2) if "'" in field["number"] else field["number"]),
        )
        for field in FIELD.finditer(text, begin, end)
    }


def _turn(span: literal.Span, number: float) -> tuple[Branch, literal.Turns]:
    """An axis at 0 may be written with either bit."""
    bits = int(number)

    def within(q_rad: Floats) -> NDArray[np.bool_]:
        below = np.array([bool(bits >> j & 1) for j in range(q_rad.shape[-1])])
        return np.where(below, q_rad < literal.EDGE_RAD, q_rad > -literal.EDGE_RAD)

    def asked(q_rad: Floats) -> NDArray[np.bool_]:
        return np.asarray(np.all(within(q_rad), axis=1), dtype=np.bool_)

    def turns(q_rad: Floats) -> list[tuple[literal.Span, str]]:
        other = [j for j, kept in enumerate(within(q_rad)) if not kept]
        return [(span, str(bits ^ sum(1 << j for j in other)))] if other else []

    return asked, turns


def _places(code: str) -> tuple[literal.Places, Callable[[str, int], Used | None]]:
    """Base and tool of an instruction, as the program has set them on its way there; of inline forms by FDAT name."""
    ways = routines_of(code, ROUTINE, WAY)
    ways += [Event(m.start(), m.lastgroup or "", (m["goto"] or m["label"]).lower()) for m in JUMP.finditer(code)]
    nothing = literal.NamedPose(refused="the tool is stationary (#TCP), not corrected" if FIXED.search(code) else "")
    place = _poses(code, ways, nothing)
    data = dict[str, tuple[str, str]]()  # of inline forms
    for match in INLINE_DATA.finditer(code):
        numbers = {key: f"{number:.0f}" for key, (_, number) in _fields(code, *match.span("fields")).items()}
        data[match["name"].upper()] = (f"BASE_DATA[{numbers.get('BASE_NO')}]", f"TOOL_DATA[{numbers.get('TOOL_NO')}]")

    def inline(fdat: str, at: int) -> Used | None:
        return (place("BASE", names[0], at), place("TOOL", names[1], at)) if (names := data.get(fdat)) else None

    def poses(match: re.Match[str]) -> tuple[literal.NamedPose | None, literal.NamedPose | None]:
        value = match["value"] or ""
        fdat = match["inline"] or ((form := INLINE_FORM.fullmatch(value)) and form["name"])
        unknown = replace(nothing, name=f"FDAT {fdat}")
        base, tool = (inline(fdat.upper(), match.start()) or (unknown, unknown)) if fdat else (None, None)
        what = (match["what"] or match["kind"] or "").upper()
        pose = place(what, value or f"{what}_DATA[{match['number']}]", match.start())
        line = literal.line_of(code, match.start())
        if ON_AXES.match(value):
            pose = replace(
                nothing, name=f"EK of line {line}", refused=f"its base is carried by external axes (EK, line {line})"
            )
        elif match["part"]:
            pose = replace(nothing, refused=f"line {line} sets only a component of ${what}, which is not followed")
        elif pose.name == f"${what}":  # written out
            pose = replace(pose, name=f"base as set in line {line}" if what == "BASE" else f"$TOOL of line {line}")
        return (None if what == "TOOL" else base or pose), (None if what == "BASE" else tool or pose)

    alone = {match.start(): match.end() for match in WITH.finditer(code)}
    sets: tuple[list[Event], list[Event]] = ([], [])
    for match in SET.finditer(code):
        if literal.line_start(code, match.start()) not in alone:
            words = words_of(re.sub(r"\{.*", "", match["value"] or match["number"] or ""))
            for events, pose in zip(sets, poses(match), strict=True):
                events += [Event(match.end(), "set", "", pose, words)] if pose else []
    base_at, tool_at = (set_above([*ways, *sets[k]], nothing, word) for k, word in enumerate(("base", "tool")))

    def places(at: int) -> Used:
        base, tool = base_at(at), tool_at(at)
        for match in SET.finditer(code, at, alone.get(at, at)):  # for this one move
            base, tool = (new or old for new, old in zip(poses(match), (base, tool), strict=True))
        return base, tool

    return places, inline


def _poses(code: str, ways: list[Event], nothing: literal.NamedPose) -> Callable[[str, str, int], literal.NamedPose]:
    """Of what a base or tool is set to at a place: a literal, or a frame as the program assigns it on its way there."""
    held = {match.start("name"): _frame(code, *match.span("fields")) for match in HELD.finditer(code)}
    assigned = [(match.start("name"), match.end(), _key(match["name"])) for match in CHANGED.finditer(code)]
    times, changes = Counter(name for _, _, name in assigned), list[tuple[int, str, literal.NamedPose]]()
    for begin, end, name in assigned:  # other variables may be local ones of several routines
        T = held.get(begin) if times[name] == 1 or "_DATA[" in name else None
        why = f"{name} is chosen while the program runs" if CHOSEN.search(name) else ""
        changes.append((end, name, replace(nothing, name=name, T=T, refused=nothing.refused or why)))
    given = replace(nothing, refused="its frame is given to a routine, which may change it")
    changes += [(match.start(), _key(match["name"]), given) for match in GIVEN.finditer(code)]
    lists = [(0, m.start()) for m in (ROUTINE.search(code),) if m] + [m.span() for m in DATA_LIST.finditer(code)]

    @cache
    def above(name: str) -> Callable[[int], literal.NamedPose]:
        others = {one for _, one, _ in changes if CHOSEN.search(one) and one.split("[")[0] == name.split("[")[0]}
        own = [(at, pose) for at, changed, pose in changes if changed in {name, *others}]
        first = [pose for at, pose in own if any(begin <= at < end for begin, end in lists)]  # there from the beginning
        first = first or [replace(nothing, name=f"{name} before the program assigns it" if own else name)]
        return set_above([*ways, *(Event(at, "set", "", one) for at, one in own)], first[-1], f"pose of {name}")

    @cache
    def constant(what: str, name: str, value: str) -> literal.NamedPose | None:
        if name in ("$NULLFRAME", "$WORLD", f"{what}_DATA[0]"):
            return replace(nothing, name=name, T=np.eye(4))
        if CHOSEN.search(name):
            return replace(nothing, name=name, refused=f"the pose of {name} is chosen while the program runs")
        written = re.fullmatch(AGGREGATE, value.rstrip(), re.IGNORECASE)
        T = _frame(value, *written.span("fields")) if written else None
        return replace(nothing, name=f"${what}", T=T) if T is not None else None

    return lambda what, value, at: constant(what, _key(value), value) or above(_key(value))(at)


def _frame(text: str, begin: int, end: int) -> Floats | None:
    fields = _fields(text, begin, end)
    return KRL.frame([fields[key][1] for key in POSE]) if all(key in fields for key in POSE) else None


def _key(name: str) -> str:
    return re.sub(r"\s", "", name).upper()


def overshoot(move: literal.Move, joints: Sequence[str]) -> str:
    """External axes that are not named stay where they are."""
    indent = move.text[: len(move.text) - len(move.text.lstrip())]
    return f"{indent}PTP {{{', '.join(f'A{j + 1} {angle}' for j, angle in enumerate(joints))}}}"


KRL = literal.Dialect("KRL", "KUKA", (".src", ".dat", ".sub"), find, KUKA, True, 4, 5, overshoot, MOTION, ";")
