"""RAPID of ABB: robtargets [[x, y, z], [q1, q2, q3, q4], [cf1, cf4, cf6, cfx], [...]] and jointtargets; mm and degrees.

Source: ABB, RAPID reference manual, data types robtarget, confdata, jointtarget: the quaternion has its scalar first;
cf1, cf4 and cf6 are the quarter turns in which axes 1, 4 and 6 stand, 0 from 0 to 90 degrees, -1 from -90 to 0.
"""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from calibrate.correct.corrected import Branch
from calibrate.correct.programs.literal import (
    NUMBER,
    Dialect,
    Literal,
    Move,
    Span,
    Targets,
    blanked,
    line_of,
    line_start,
    moves_of,
    numbers_in,
)
from calibrate.correct.rotations import QUATERNION

Floats = NDArray[np.float64]


def _list(count: int) -> str:
    return rf"\[\s*{NUMBER}(?:\s*,\s*{NUMBER}){{{count - 1}}}\s*\]"


ROBTARGET = rf"(?P<pose>\[\s*{_list(3)}\s*,\s*{_list(4)}\s*,\s*{_list(4)}\s*,\s*{_list(6)}\s*\])"
JOINTTARGET = rf"(?P<joints>\[\s*{_list(6)}\s*,\s*{_list(6)}\s*\])"
TARGET = re.compile(f"{ROBTARGET}|{JOINTTARGET}")
NAMED = re.compile(r"\b(?:robtarget|jointtarget)\s+(?P<name>\w+)\s*:=\s*$", re.IGNORECASE)
INLINE = re.compile(r"\bMove(?:J|AbsJ|L)\s+$", re.IGNORECASE)
MOVE = re.compile(r"\bMove(?:J|AbsJ|L|C|\w+)\s+(?P<target>[A-Za-z_]\w*)", re.IGNORECASE)
CIRCLE = re.compile(r"\bMoveC\b", re.IGNORECASE)
REST = re.compile(r"\bMove\w+\s+(?:\[.*\]\]|\w+)\s*(?P<rest>(?:\\[^,]*)?,.*;)", re.IGNORECASE)
QUARTER = np.pi / 2.0
CF = ((0, 0), (1, 3), (2, 5))  # entry of confdata, joint from 0


def find(text: str, n_joints: int) -> Targets:
    """Of a module."""
    code = blanked(text, "!")
    by_name = moves_of(text, code, MOVE)
    literals: list[Literal] = []
    for match in TARGET.finditer(code):
        start = line_start(text, match.start())
        end = text.find("\n", match.end())
        before = code[start : match.start()]
        named, inline = NAMED.search(before), INLINE.search(before)
        if inline:
            moves = (Move(start, text[start : len(text) if end < 0 else end]),)
            name = f"line {line_of(text, match.start())}"
        elif named:
            name, moves = named["name"], tuple(by_name.get(named["name"].lower(), ()))
        else:
            continue
        literals.append(_literal(text, match, name, moves))
    known = {one.name.lower() for one in literals}
    skipped = [
        f"line {line_of(text, move.line_start)}: {move.text.strip()}: its target is not a literal of this file"
        for target, moves in by_name.items()
        if target not in known
        for move in moves
    ]
    skipped += [f"line {line_of(text, m.start())}: a circular move is not corrected" for m in CIRCLE.finditer(code)]
    if n_joints != 6:
        return Targets((), (*skipped, f"RAPID targets have six axes, this arm has {n_joints}"))
    return Targets(tuple(literals), tuple(dict.fromkeys(skipped)))


def _literal(text: str, match: re.Match[str], name: str, moves: tuple[Move, ...]) -> Literal:
    group = "pose" if match["pose"] else "joints"
    found: list[tuple[Span, float]] = list(numbers_in(text, *match.span(group)))
    taken = found[:7] if group == "pose" else found[:6]
    spans, numbers = tuple(s for s, _ in taken), tuple(v for _, v in taken)
    branch = _quarters([int(v) for _, v in found[7:11]]) if group == "pose" else None
    return Literal(name, match.start(group), spans, numbers, group == "joints", moves, branch)


def _quarters(cf: Sequence[int]) -> Branch:
    def asked(q_rad: Floats) -> NDArray[np.bool_]:
        quarter = np.floor(q_rad / QUARTER)
        return np.asarray(np.all([quarter[:, j] == cf[k] for k, j in CF], axis=0), dtype=np.bool_)

    return asked


def overshoot(move: Move, joints: Sequence[str]) -> str:
    """With the speed, zone and tool of the move that it stands before; the zone is `fine`, so that it is reached."""
    indent = move.text[: len(move.text) - len(move.text.lstrip())]
    match = REST.search(move.text)
    rest = ", v100, fine, tool0;" if match is None else match["rest"]
    parts = rest.lstrip(", ").split(",", 2)
    if len(parts) == 3:
        rest = f", {parts[0].strip()}, fine, {parts[2].strip()}"
    nothing = ", ".join(["9E9"] * 6)
    return f"{indent}MoveAbsJ [[{', '.join(joints)}], [{nothing}]]{rest}"


RAPID = Dialect("RAPID", "ABB", (".mod", ".prg", ".modx"), find, QUATERNION, True, 4, 8, overshoot)
