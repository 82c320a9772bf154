"""FANUC programs as text (.ls): positions P[n] behind /POS, X, Y, Z, W, P, R or J1 ... J6 with their units.

W, P, R turn about the fixed x, y, z. Numbers keep three decimals, as a controller writes them. A new position would
need a number of its own and new line numbers behind it, so overshoot points are not inserted here.
"""

import re

import numpy as np

from calibrate.apply.correct.rotations import FANUC
from calibrate.apply.programs.literal import (
    NUMBER,
    Dialect,
    Literal,
    Move,
    NamedPose,
    Targets,
    instruction,
    line_of,
)

POSITION = re.compile(r"P\[\s*(?P<number>\d+)[^\]]*\]\s*\{(?P<body>[^}]*)\}")
FIELD = re.compile(rf"\b(?P<key>X|Y|Z|W|P|R|J[1-9])\s*=\s*(?P<number>{NUMBER})\s*(?P<unit>mm|deg)")
EXTERNAL = re.compile(rf"\bE(?P<n>[1-9])\s*=\s*(?P<number>{NUMBER})\s*(?:mm|deg)")
FRAMES = (("UF", re.compile(r"UF\s*:\s*(?P<n>\w+)")), ("UT", re.compile(r"UT\s*:\s*(?P<n>\w+)")))
GROUP = re.compile(r"\bGP(?P<n>\d+)\s*:(?P<fields>(?:(?!\bGP\d)[^}])*)")
# The end of an arc of C stands in a line of its own.
MOVE = re.compile(r"^[ \t]*(?:\d*:\s*[JLCA]|:)\s+(?P<register>PR?)\[\s*(?P<number>\d*)", re.MULTILINE)
MOTION = re.compile(r"^[ \t]*(?P<go>\d*:[ \t]*[JLCAS][ \t]+\S)", re.MULTILINE)
# Controllers write the words in their language (WKZ_Offset), registers of an offset in one form.
MOVED = re.compile(r"\b(?:\w*OFFSET|INC|COORD|RTCP)\b|(?<=,)[PV]R\b(?!\s*=)", re.IGNORECASE)
POSE = ("X", "Y", "Z", "W", "P", "R")


def find(text: str, n_joints: int) -> Targets:
    """Only positions in the listing, of motion group 1; position registers are of the controller."""
    begin = text.find("\n/POS")
    body = len(text) if begin < 0 else begin
    by_number: dict[str, list[Move]] = {}
    skipped: list[tuple[int, str]] = []
    left = set[str]()  # numbers of points
    for match in MOVE.finditer(text, 0, body):
        move = instruction(text, match.start("register"), lambda at: (NamedPose(), NamedPose()), ";")
        written = " ".join(text[match.start("register") : move.line_start + len(move.text)].split())
        if match["register"] == "PR":
            skipped.append((match.end(), "position registers are not corrected"))
        elif not match["number"]:
            skipped.append((match.end(), f"{written}: its position is chosen while the program runs"))
        elif found := MOVED.search(re.sub(r"\[[^\]]*\]", "", written)):
            skipped.append((match.end(), f"{written}: with {found[0]} the place is not that of the position"))
            left.add(match["number"])
        else:
            by_number.setdefault(match["number"], []).append(move)
    literals: list[Literal] = []
    idle: list[Move] = []
    for match in POSITION.finditer(text, body):
        moves = tuple(by_number.pop(match["number"], ()))
        one = _literal(text, match, moves, n_joints)
        if isinstance(one, str):
            skipped.append((match.start(), f"P[{match['number']}]: {one}; not corrected"))
            idle += moves
        elif moves or match["number"] not in left:
            literals.append(one)
    absent = ((move.line_start, number) for number, moves in by_number.items() for move in moves)
    skipped += [(at, f"P[{number}] is not in this file") for at, number in absent]
    sentences = dict.fromkeys(f"line {line_of(text, at)}: {why}" for at, why in skipped)
    return Targets(tuple(literals), tuple(sentences), moves=tuple(idle))


def _literal(text: str, match: re.Match[str], moves: tuple[Move, ...], n_joints: int) -> Literal | str:
    """Of group 1; else why it is not corrected."""
    groups = GROUP.finditer(text, *match.span("body"))
    parts = {group["n"]: group.span("fields") for group in groups} or {"1": match.span("body")}
    whole = {n: numbers for n, part in parts.items() if (numbers := _numbers(text, part, n_joints))}
    if "1" not in whole:
        return "not a whole position of motion group 1 in mm and deg"
    if len(whole) > 1:
        return f"motion groups {', '.join(whole)} each hold a whole position, which may be of another arm"
    joints, fields = whole["1"]
    frame, tool = (_place(what, pattern.search(text, *parts["1"])) for what, pattern in FRAMES)
    spans, values = tuple(field.span("number") for field in fields), tuple(float(field["number"]) for field in fields)
    axes = tuple((f"E{axis['n']}", float(axis["number"])) for axis in EXTERNAL.finditer(text, *parts["1"]))
    name = f"P[{match['number']}]"
    return Literal(name, parts["1"][0], spans, values, joints, moves, own=(frame, tool), external=axes)


def _numbers(text: str, part: tuple[int, int], n_joints: int) -> tuple[bool, list[re.Match[str]]] | None:
    """Whether they are joint angles, and each; None: not a whole position."""
    found = {field["key"]: field for field in FIELD.finditer(text, *part)}
    if any((field["unit"] == "mm") != (key in "XYZ") for key, field in found.items()):
        return None
    for keys, joints in ((POSE, False), (tuple(f"J{j + 1}" for j in range(n_joints)), True)):
        if all(key in found for key in keys):
            return joints, [found[key] for key in keys]
    return None


def _place(what: str, found: re.Match[str] | None) -> NamedPose:
    """Frame 0 is the robot's own; of the others a listing holds the number only."""
    if found is None:
        return NamedPose()
    return NamedPose(f"{what} {found['n']}", np.eye(4) if found["n"] == "0" else None)


FANUC_LS = Dialect("FANUC LS", "FANUC", (".ls",), find, FANUC, True, 3, 3, None, MOTION, "!")
