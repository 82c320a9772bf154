"""URScript: poses p[x, y, z, rx, ry, rz] in m and rad, and joint lists [q1, ... q6], as first arguments of moves.

Source: Universal Robots, The URScript Programming Language, movej, movel, movep, movec: a pose is a rotation vector;
movej and movel take either form; a comment begins with #.
"""

import re
from collections.abc import Sequence

import numpy as np

from calibrate.correct.programs import literal
from calibrate.correct.rotations import VECTOR

LIST = rf"(?P<pose>p?)\[\s*{literal.NUMBER}(?:\s*,\s*{literal.NUMBER})*\s*\]"
MOVE = re.compile(r"\b(?:movej|movel|movep|servoj|movec)\s*\(\s*(?P<target>p?\[|[A-Za-z_]\w*)")
INLINE = re.compile(rf"\b(?:movej|movel|movep|servoj)\s*\(\s*(?:q\s*=\s*|pose\s*=\s*)?{LIST}")
ASSIGNED = re.compile(rf"(?<!\w)(?P<name>[A-Za-z_]\w*)\s*=\s*{LIST}")
TCP = re.compile(rf"\bset_tcp\s*\(\s*(?P<literal>{LIST}\s*\))?")
CIRCLE = re.compile(r"\bmovec\s*\(")


def find(text: str, n_joints: int) -> literal.Targets:
    """Literals of moves, and of variables that moves go to."""
    code = literal.blanked(text, "#")
    places = _places(code)
    by_name = literal.moves_of(text, code, MOVE, places)
    literals: list[literal.Literal] = []
    for match in INLINE.finditer(code):
        literals.append(_literal(text, match, "", (literal.instruction(text, match.start(), places),), n_joints))
    for match in ASSIGNED.finditer(code):
        if match["name"].lower() in by_name:
            moves = tuple(by_name[match["name"].lower()])
            literals.append(_literal(text, match, match["name"], moves, n_joints))
    good = [one for one in literals if len(one.numbers) == (n_joints if one.joints else 6)]
    named = {target: moves for target, moves in by_name.items() if target not in ("[", "p[")}
    circles = ((m.start(), "a circular move is not corrected") for m in CIRCLE.finditer(code))
    skipped = literal.sentences(text, named, good, circles)
    return literal.Targets(tuple(sorted(good, key=lambda one: one.at)), skipped)


def _places(code: str) -> literal.Places:
    """Poses are in the base, with the tool centre point that was set last above."""
    base = literal.NamedPose("base", np.eye(4))
    starts, tools = list[int](), list[literal.NamedPose]()
    for match in TCP.finditer(code):
        numbers = [v for _, v in literal.numbers_in(code, *match.span("literal"))] if match["literal"] else []
        line = f"set_tcp of line {literal.line_of(code, match.start())}"
        starts.append(match.start())
        tools.append(literal.NamedPose(line, URSCRIPT.frame(numbers) if len(numbers) == 6 else None))
    return lambda at: (base, literal.last_before(tools, starts, at, literal.NamedPose()))


def _literal(
    text: str, match: re.Match[str], name: str, moves: tuple[literal.Move, ...], n_joints: int
) -> literal.Literal:
    at = match.start("pose")
    found = list(literal.numbers_in(text, at, match.end()))
    label = name or f"line {literal.line_of(text, at)}"
    return literal.Literal(label, at, tuple(s for s, _ in found), tuple(v for _, v in found), not match["pose"], moves)


def overshoot(move: literal.Move, joints: Sequence[str]) -> str:
    """A slow move with the script's default acceleration."""
    indent = move.text[: len(move.text) - len(move.text.lstrip())]
    return f"{indent}movej([{', '.join(joints)}], v=0.25)"


URSCRIPT = literal.Dialect("URScript", "UR", (".script", ".urscript"), find, VECTOR, False, 7, 7, overshoot)
