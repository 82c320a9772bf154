"""URScript: poses p[x, y, z, rx, ry, rz] in m and rad, and joint lists [q1, ... q6], as first arguments of moves.

Source: Universal Robots, The URScript Programming Language, movej, movel, movep, movec: a pose is a rotation vector;
movej and movel take either form; a comment begins with #.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from calibrate.apply.correct.rotations import VECTOR
from calibrate.apply.programs import literal
from calibrate.apply.programs.stated_frames import (
    CALL,
    Event,
    Used,
    closed,
    routines_of,
    set_above,
    words_of,
)

LIST = rf"(?P<pose>p?)\[\s*{literal.NUMBER}(?:\s*,\s*{literal.NUMBER})*\s*\]"
NAME = r"[A-Za-z_]\w*(?:\[[^\[\]]*\])?"
CALLED = r"(?:\((?:[^()\n]|\([^()\n]*\))*\))?"
SOLVED = r"(?:get_inverse_kin\s*\(\s*(?:x\s*=\s*)?)?"  # a pose that the script itself turns into joint angles
FEATURE = r"pose_trans\s*\(\s*(?P<feature>[A-Za-z_]\w*)\s*,\s*"  # a pose within a named one
FIRST = r"\s*\(\s*(?:\w+\s*=\s*)?"
# An arc has two targets, of which each may be in a pose of its own: only plain ones are read.
GOES = rf"\b(?:movec{FIRST}|(?:movej|movel|movep|servoj|servoc){FIRST}(?:{SOLVED}{FEATURE}|{SOLVED}))"
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
MOTION = re.compile(r"\b(?P<go>(?:opti)?move[jlpc]|servo[jc])[ \t]*\(")
GOING = re.compile(GOES)
SOLUTION = re.compile(r"\bget_inverse_kin\s*\(")
ARGUMENTS = ("x", "qnear", "maxPositionError", "maxOrientationError", "tcp")  # of get_inverse_kin, in their order
OWN_TOOL = re.compile(r"\btcp\s*=\s*p\[[^\]]*\]")  # of get_inverse_kin
TCP = re.compile(rf"\bset_tcp\s*\(\s*(?:(?P<literal>{LIST}\s*[,)])|(?P<words>[^\n]*))")


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
    asked = _asked_postures(code)
    literals = [replace(one, near=asked(one.moves)) for one in literals]
    good = [one for one in literals if len(one.numbers) == (n_joints if one.joints else 6)]
    unread = literal.unread(text, code, POSE, good)
    left = (one for one in unread if not any(begin <= one[0] < end for begin, end in _no_targets(code)))
    skipped = literal.sentences(code, by_name, good, CHANGED, left)
    absent = literal.absent(code, CALL.finditer(code), ROUTINE, BUILT_IN, "sets the tool (set_tcp)")
    return literal.Targets(tuple(sorted(good, key=lambda one: one.at)), skipped, absent)


def _no_targets(code: str) -> list[literal.Span]:
    """Where tools stand, and poses within which the script has its targets."""
    features = {match["feature"] for match in MOVE.finditer(code)}
    assigned = [match.span() for match in ASSIGNED.finditer(code) if match["name"] in features]
    return [match.span() for tools in (TCP, OWN_TOOL) for match in tools.finditer(code)] + assigned


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
    above, within = set_above(events, literal.NamedPose(), "tool"), _features(code)

    def places(at: int) -> Used:
        tool, going = above(at), GOING.match(code, at)
        if (solution := _solution(code[at : at + literal.LONGEST_MOVE].split("\n")[0])) and "tcp" in solution:
            tool = literal.NamedPose(refused="get_inverse_kin has a tool of its own (tcp)")
        return within(going["feature"], at) if going and going["feature"] else base, tool

    return places


def _features(code: str) -> Callable[[str, int], literal.NamedPose]:
    """Of the first pose of pose_trans at a place: as the script has assigned it on its way there."""
    ways, targets = routines_of(code, ROUTINE, WAY), set[str]()
    for match in (*MOVE.finditer(code), *ARC_END.finditer(code)):
        if match.re is ARC_END or match["feature"] is None:
            targets.add(literal.key(match["target"]))
    written = {match.start("name"): match for match in ASSIGNED.finditer(code)}

    @cache
    def above(name: str) -> Callable[[int], literal.NamedPose]:
        events = list(ways)
        for match in CHANGED.finditer(code):
            if match["name"].split("[")[0] == name:
                pose = written.get(match.start("name"))
                numbers = [v for _, v in literal.numbers_in(code, pose.start("pose"), pose.end())] if pose else []
                line = literal.line_of(code, match.start("name"))
                why = "" if len(numbers) == 6 else f"{name} of pose_trans is computed in line {line}"
                T = None if why else URSCRIPT.frame(numbers)
                events.append(Event(match.end(), "set", "", literal.NamedPose(name, T, why)))
        return set_above(events, literal.NamedPose(name), f"pose {name} of pose_trans")

    def within(name: str, at: int) -> literal.NamedPose:
        if literal.key(name) in targets:
            return literal.NamedPose(refused=f"{name} of pose_trans is a target of another move")
        return above(name)(at)

    return within


def _solution(instruction: str) -> dict[str, str]:
    """Arguments of get_inverse_kin by name; empty where an instruction has none."""
    if (match := SOLUTION.search(instruction)) is None:
        return {}
    given = instruction[match.end() : closed(instruction, match.end() - 1)]
    found: dict[str, str] = {}
    for name, argument in zip(ARGUMENTS, literal.arguments(given), strict=False):
        named = re.fullmatch(r"\s*(\w+)\s*=(?!=)(.*)", argument, re.DOTALL)
        found[named[1] if named else name] = (named[2] if named else argument).strip()
    return found


def _asked_postures(code: str) -> Callable[[Sequence[literal.Move]], tuple[float, ...]]:
    """Of the moves to a target, the joint angles near which get_inverse_kin looks; empty where they do not agree."""
    times = Counter(match["name"].split("[")[0] for match in CHANGED.finditer(code))
    lists = {m["name"]: _numbers(m) for m in ASSIGNED.finditer(code) if not m["pose"] and times[m["name"]] == 1}

    def asked(moves: Sequence[literal.Move]) -> tuple[float, ...]:
        found = set[tuple[float, ...]]()
        for near in (_solution(move.text).get("qnear", "") for move in moves):
            written = re.fullmatch(LIST, near)
            found.add(_numbers(written) if written and not written["pose"] else lists.get(near, ()))
        return found.pop() if len(found) == 1 else ()

    return asked


def _numbers(match: re.Match[str]) -> tuple[float, ...]:
    return tuple(v for _, v in literal.numbers_in(match.string, match.start("pose"), match.end()))


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


URSCRIPT = literal.Dialect(
    "URScript", "UR", (".script", ".urscript"), find, VECTOR, False, 7, 7, overshoot, MOTION, "#"
)
