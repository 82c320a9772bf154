"""URScript: poses p[x, y, z, rx, ry, rz] in m and rad, and joint lists [q1, ... q6], as first arguments of moves.

Source: Universal Robots, The URScript Programming Language, movej, movel, movep, movec: a pose is a rotation vector;
movej and movel take either form; a comment begins with #.
"""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from calibrate.apply.correct.rotations import VECTOR
from calibrate.apply.programs import literal
from calibrate.apply.programs.stated_frames import (
    CALL,
    Event,
    closed,
    routines_of,
    set_above,
    words_of,
)

LIST = rf"(?P<pose>p?)\[\s*{literal.NUMBER}(?:\s*,\s*{literal.NUMBER})*\s*\]"
NAME = r"[A-Za-z_]\w*(?:\[[^\[\]]*\])?"
CALLED = r"(?:\((?:[^()\n]|\([^()\n]*\))*\))?"
GOES = r"\b(?:movej|movel|movep|servoj|servoc|movec)\s*\(\s*(?:\w+\s*=\s*)?"
MOVE = re.compile(rf"{GOES}(?P<target>p?\[|{NAME})")
INLINE = re.compile(rf"{GOES}{LIST}")
# An arc has two targets: a point on it, and its end.
ARC = rf"\bmovec\s*\(\s*(?:\w+\s*=\s*)?(?:{NAME}{CALLED}|p\[[^\[\]]*\])\s*,\s*(?:\w+\s*=\s*)?"
ARC_END = re.compile(rf"{ARC}(?P<target>p?\[|{NAME})")
INLINE_END = re.compile(ARC + LIST)
POSE = re.compile(rf"(?<!\w)(?P<pose>p)\[\s*{literal.NUMBER}(?:\s*,\s*{literal.NUMBER}){{5}}\s*\]")
ARRAY = re.compile(r"(?<!\w)(?P<name>[A-Za-z_]\w*)\s*=\s*\[\s*(?=p\[)")
ASSIGNED = re.compile(rf"(?<!\w)(?P<name>[A-Za-z_]\w*)\s*=\s*{LIST}")
CHANGED = re.compile(
    r"^[ \t]*(?:(?:global|local)[ \t]+)?(?P<name>[A-Za-z_]\w*(?:\[[^\[\]\n]*\])?)[ \t]*=(?!=)[ \t]*", re.MULTILINE
)
ROUTINE = re.compile(r"^[ \t]*(?:def|thread|sec)\s+(?P<name>\w+)\s*\((?P<parameters>[^)]*)", re.MULTILINE)
WAY = re.compile(
    r"(?<![\w.])(?:(?P<while>while\b[^:]*)|(?P<if>if\b[^:]*)|(?P<else>elif\b[^:]*)|(?P<otherwise>else)|(?P<end>end)"
    r"|(?P<return>return\b(?:(?!\bend\b)[^\n])*)|(?P<break>break|continue))(?!\w)"
)
BUILT_IN = literal.built_in(r"""
    def thread sec if elif while return and or x?or not in run join kill assert halt sleep sync popup textmsg pause
    (?:opti)?move[jlpc] servo[jc] speed[jl] stop[jl] a?(?:sin|cos|tan) atan2 sqrt pow log ceil floor norm length random
    d2r r2d size inv transpose normalize make_list binary_list_to_integer integer_to_binary_list point_dist
    (?:pose|str|get|is|read|write|socket|modbus|rtde|rpc|request|encoder|conveyor)_\w+ interpolate_pose wrench_trans
    rotvec2rpy rpy2rotvec to_num to_str force(?:_mode\w*)? (?:freedrive|teach)_mode\w*
    end_(?:force|freedrive|teach)_mode (?:end_)?screw_driving tool_contact\w* track_conveyor_\w+ stop_conveyor_tracking
    path_offset_\w+ position_deviation_warning reset_revolution_counter zero_ftsensor ft_rtde_input_enable
    power(?:down|_\w+) direct_torque enable_external_ft_sensor set_(?:standard|configurable|runstate|gp)_\w+
    set_(?:tcp|gravity|pos|flag|(?:target_)?payload\w*|conveyor_tick_count|input_actions_to_default)
    set_(?:tool_)?(?:voltage|output_mode|communication|(?:digital|analog)_\w+)
    set_(?:analog\w+|safety_mode_transition_hardness|base_acceleration)""")
TCP = re.compile(rf"\bset_tcp\s*\(\s*(?:(?P<literal>{LIST}\s*\))|(?P<words>[^\n]*))")


def find(text: str, n_joints: int) -> literal.Targets:
    """Literals of moves, and of variables that moves go to."""
    code = literal.blanked(text, "#")
    places = _places(code)
    by_name = literal.moves_of(text, code, (MOVE, ARC_END), places)
    literals: list[literal.Literal] = []
    for match in (*INLINE.finditer(code), *INLINE_END.finditer(code)):
        literals.append(_literal(text, match, "", (literal.instruction(text, match.start(), places),)))
    named = [(match["name"], match) for match in ASSIGNED.finditer(code)]
    named += [(f"{array['name']}[{k}]", one) for array in ARRAY.finditer(code) for k, one in _elements(code, array)]
    for name, match in named:
        if moves := literal.moves_to(by_name, name):
            literals.append(_literal(text, match, name, moves))
    good = [one for one in literals if len(one.numbers) == (n_joints if one.joints else 6)]
    tools = [match.span() for match in TCP.finditer(code)]
    unread = literal.unread(text, code, POSE, good)
    left = (one for one in unread if not any(begin <= one[0] < end for begin, end in tools))
    skipped = literal.sentences(code, by_name, good, CHANGED, left)
    absent = literal.absent(code, CALL.finditer(code), ROUTINE, BUILT_IN, "sets the tool (set_tcp)")
    return literal.Targets(tuple(sorted(good, key=lambda one: one.at)), skipped, absent)


def _places(code: str) -> literal.Places:
    """Poses are in the base, with the tool centre point that is set on the way there."""
    base, tools = literal.NamedPose("base", np.eye(4)), list(TCP.finditer(code))
    # The first function is the program; others that nothing here calls are called by what is not in the file.
    events = routines_of(code, ROUTINE, WAY, literal.NamedPose("the caller") if tools else None)
    for match in tools:
        numbers = [v for _, v in literal.numbers_in(code, *match.span("literal"))] if match["literal"] else []
        line = f"set_tcp of line {literal.line_of(code, match.start())}"
        tool = literal.NamedPose(line, URSCRIPT.frame(numbers) if len(numbers) == 6 else None)
        events.append(Event(closed(code, match.start()), "set", "", tool, words_of(match["words"] or "")))
    above = set_above(events, literal.NamedPose(), "tool")
    return lambda at: (base, above(at))


def _elements(code: str, array: re.Match[str]) -> Iterator[tuple[int, re.Match[str]]]:
    """Poses of a list, counted from 0."""
    at, k = array.end(), 0
    while (one := POSE.match(code, at)) is not None:
        yield k, one
        at, k = len(code) - len(code[one.end() :].lstrip(", \t\r\n")), k + 1


def _literal(text: str, match: re.Match[str], name: str, moves: tuple[literal.Move, ...]) -> literal.Literal:
    at = match.start("pose")
    found = list(literal.numbers_in(text, at, match.end()))
    label = name or f"line {literal.line_of(text, at)}"
    return literal.Literal(label, at, tuple(s for s, _ in found), tuple(v for _, v in found), not match["pose"], moves)


def overshoot(move: literal.Move, joints: Sequence[str]) -> str:
    """A slow move with the script's default acceleration."""
    indent = move.text[: len(move.text) - len(move.text.lstrip())]
    return f"{indent}movej([{', '.join(joints)}], v=0.25)"


URSCRIPT = literal.Dialect("URScript", "UR", (".script", ".urscript"), find, VECTOR, False, 7, 7, overshoot)
