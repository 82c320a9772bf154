"""KRL of KUKA: aggregates {X .., Y .., Z .., A .., B .., C .., S .., T ..} and {A1 .., ... A6 ..}; mm and degrees.

A, B, C turn about z, y, x. Bit n of T is set where axis n + 1 stands below 0 degrees: it fixes the posture. Taken are
targets of PTP, LIN, SPTP and SLIN and declared points; tools, bases and relative moves are none.
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
)
from calibrate.correct.rotations import KUKA

Floats = NDArray[np.float64]

AGGREGATE = r"\{(?:\s*(?:E6POS|E6AXIS|POS|AXIS|FRAME)\s*:)?(?P<fields>[^{}\[\]]*)\}"
FIELD = re.compile(rf"\b(?P<key>[A-Z]\w*)\s+(?P<number>{NUMBER})", re.IGNORECASE)
INLINE = re.compile(rf"^[ \t]*S?(?:PTP|LIN)\s+{AGGREGATE}", re.IGNORECASE | re.MULTILINE)
DECLARED = re.compile(
    rf"^[ \t]*(?:DECL\s+)?(?:GLOBAL\s+)?(?:CONST\s+)?(?:E6POS|E6AXIS|POS|AXIS)\s+(?P<name>\w+)\s*=\s*{AGGREGATE}",
    re.IGNORECASE | re.MULTILINE,
)
MOVE = re.compile(r"^[ \t]*S?(?:PTP|LIN|CIRC)\s+(?P<target>[A-Za-z_]\w*)", re.IGNORECASE | re.MULTILINE)
OTHER = re.compile(r"^[ \t]*S?(?:CIRC|PTP_REL|LIN_REL|CIRC_REL)\b", re.IGNORECASE | re.MULTILINE)
POSE = ("X", "Y", "Z", "A", "B", "C")


def find(text: str, n_joints: int) -> Targets:
    """Of .src and of .dat."""
    code = blanked(text, ";")
    by_name = moves_of(text, code, MOVE)
    literals: list[Literal] = []
    skipped: list[str] = []
    for match in (*INLINE.finditer(code), *DECLARED.finditer(code)):
        inline = match.re is INLINE
        if inline:
            start = line_start(text, match.end())
            end = text.find("\n", match.end())
            moves = (Move(start, text[start : len(text) if end < 0 else end]),)
            name = f"line {line_of(text, match.start('fields'))}"
        else:
            name = match["name"]
            moves = tuple(by_name.get(name.lower(), ()))
        one = _literal(text, match, name, moves, n_joints)
        if one is None:
            skipped.append(f"{name}: an aggregate that does not state the whole target is not corrected")
        else:
            literals.append(one)
    known = {one.name.lower() for one in literals}
    skipped += [
        f"line {line_of(text, move.line_start)}: {move.text.strip()}: its target is not declared in this file"
        for target, moves in by_name.items()
        if target not in known
        for move in moves
    ]
    skipped += [
        f"line {line_of(text, m.end())}: {m.group().strip()}: circular and relative moves are not corrected"
        for m in OTHER.finditer(code)
    ]
    return Targets(tuple(sorted(literals, key=lambda one: one.at)), tuple(dict.fromkeys(skipped)))


def _literal(text: str, match: re.Match[str], name: str, moves: tuple[Move, ...], n_joints: int) -> Literal | None:
    begin, end = match.span("fields")
    spans: dict[str, Span] = {}
    numbers: dict[str, float] = {}
    for field in FIELD.finditer(text, begin, end):
        key = field["key"].upper()
        spans[key], numbers[key] = field.span("number"), float(field["number"])
    for keys, joints in ((POSE, False), (tuple(f"A{j + 1}" for j in range(n_joints)), True)):
        if all(key in numbers for key in keys):
            branch = None if joints or "T" not in numbers else _turn(int(numbers["T"]))
            values, places = tuple(numbers[k] for k in keys), tuple(spans[k] for k in keys)
            return Literal(name, begin, places, values, joints, moves, branch)
    return None


def _turn(bits: int) -> Branch:
    def asked(q_rad: Floats) -> NDArray[np.bool_]:
        below = np.array([bool(bits >> j & 1) for j in range(q_rad.shape[1])])
        return np.asarray(np.all((q_rad < 0.0) == below, axis=1), dtype=np.bool_)

    return asked


def overshoot(move: Move, joints: Sequence[str]) -> str:
    """External axes that are not named stay where they are."""
    indent = move.text[: len(move.text) - len(move.text.lstrip())]
    return f"{indent}PTP {{{', '.join(f'A{j + 1} {angle}' for j, angle in enumerate(joints))}}}"


KRL = Dialect("KRL", "KUKA", (".src", ".dat", ".sub"), find, KUKA, True, 4, 5, overshoot)
