"""FANUC programs as text (.ls): positions P[n] behind /POS, X, Y, Z, W, P, R or J1 ... J6 with their units.

W, P, R turn about the fixed x, y, z. Numbers keep three decimals, as a controller writes them. A new position would
need a number of its own and new line numbers behind it, so overshoot points are not inserted here.
"""

import re

import numpy as np

from calibrate.correct.programs.literal import (
    NUMBER,
    Dialect,
    Literal,
    Move,
    NamedPose,
    Span,
    Targets,
    instruction,
    line_of,
)
from calibrate.correct.rotations import FANUC

POSITION = re.compile(r"P\[\s*(?P<number>\d+)[^\]]*\]\s*\{(?P<body>[^}]*)\}")
FIELD = re.compile(rf"\b(?P<key>X|Y|Z|W|P|R|J[1-9])\s*=\s*(?P<number>{NUMBER})\s*(?P<unit>mm|deg)")
FRAMES = (("user frame", re.compile(r"UF\s*:\s*(?P<n>\w+)")), ("tool frame", re.compile(r"UT\s*:\s*(?P<n>\w+)")))
# The end of an arc of C stands in a line of its own.
MOVE = re.compile(r"^[ \t]*(?:\d*:\s*[JLCA]|:)\s+(?P<target>P(?:R)?\[\s*\d+)", re.MULTILINE)
POSE = ("X", "Y", "Z", "W", "P", "R")


def find(text: str, n_joints: int) -> Targets:
    """Only positions in the listing; position registers are of the controller."""
    begin = text.find("\n/POS")
    body = len(text) if begin < 0 else begin
    by_number: dict[str, list[Move]] = {}
    skipped: list[str] = []
    for match in MOVE.finditer(text, 0, body):
        target = re.sub(r"\s", "", match["target"])
        if target.startswith("PR["):
            skipped.append(f"line {line_of(text, match.end())}: position registers are not corrected")
            continue
        by_number.setdefault(target[2:], []).append(
            instruction(text, match.start(), lambda at: (NamedPose(), NamedPose()))
        )
    literals: list[Literal] = []
    for match in POSITION.finditer(text, body):
        one = _literal(text, match, tuple(by_number.get(match["number"], ())), n_joints)
        if one is None:
            skipped.append(f"P[{match['number']}]: not a whole position in mm and deg; not corrected")
        else:
            literals.append(one)
    return Targets(tuple(literals), tuple(dict.fromkeys(skipped)))


def _literal(text: str, match: re.Match[str], moves: tuple[Move, ...], n_joints: int) -> Literal | None:
    spans: dict[str, Span] = {}
    numbers: dict[str, float] = {}
    for field in FIELD.finditer(text, *match.span("body")):
        if (field["unit"] == "mm") != (field["key"] in "XYZ"):
            return None
        spans[field["key"]], numbers[field["key"]] = field.span("number"), float(field["number"])
    frame, tool = (_place(what, pattern.search(match["body"])) for what, pattern in FRAMES)
    for keys, joints in ((POSE, False), (tuple(f"J{j + 1}" for j in range(n_joints)), True)):
        if all(key in numbers for key in keys):
            values, places = tuple(numbers[k] for k in keys), tuple(spans[k] for k in keys)
            name = f"P[{match['number']}]"
            return Literal(name, match.start("body"), places, values, joints, moves, own=(frame, tool))
    return None


def _place(what: str, found: re.Match[str] | None) -> NamedPose:
    """Frame 0 is the robot's own; of the others a listing holds the number only."""
    if found is None:
        return NamedPose()
    return NamedPose(f"{what} {found['n']}", np.eye(4) if found["n"] == "0" else None)


FANUC_LS = Dialect("FANUC LS", "FANUC", (".ls",), find, FANUC, True, 3, 3, None)
