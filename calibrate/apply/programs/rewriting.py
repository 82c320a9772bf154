"""A program with corrected targets: literals are replaced where they stand, everything else is kept byte for byte.

The prediction is made of the numbers as they are written, rounding included.
"""

import difflib
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.files import shown
from acquisition.recording.files.bounds import ANGLE_RAD, LENGTH_M
from calibrate.apply.correct.corrected import (
    Arms,
    Corrected,
    Inverse,
    Options,
    Wanted,
    correct,
    moves_conditions,
    predicted_errors,
    wanted_joints,
)
from calibrate.apply.programs.examined import LINE, examined, nothing_but_joints, nothing_corrected
from calibrate.apply.programs.fanuc_ls import FANUC_LS
from calibrate.apply.programs.krl import KRL
from calibrate.apply.programs.literal import (
    Dialect,
    Literal,
    Move,
    NamedPose,
    Targets,
    last_before,
    line_of,
)
from calibrate.apply.programs.rapid import RAPID
from calibrate.apply.programs.stated_frames import stated
from calibrate.apply.programs.urscript import URSCRIPT
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]

# Moves along a line or an arc, of all dialects.
ALONG = re.compile(
    r"\b(?:(?:Move|Arc|Cap|Cut|Disp|Paint|Trigg)[LC]|S?LIN\b|S?CIRC\b|move[lpc]\b)|^\s*\d*:\s*[LCA]\s", re.IGNORECASE
)
ASSIGNS = re.compile(r"\s*[\w.$\[\]{}]+\s*:?=")  # no move
ARC = re.compile(r"\b(?:(?:Move|Arc|Cap|Cut|Disp|Paint|Trigg)C|S?CIRC\b|movec\b)", re.IGNORECASE)
SPLINE = re.compile(r"^[ \t]*(?P<end>END|PTP_)?SPLINE\b", re.IGNORECASE | re.MULTILINE)
OWN = re.compile(r"wobj0|\$NULLFRAME|\$WORLD|BASE_DATA\[0\]|UF 0|base")  # the robot's base, in all dialects
DIALECTS = (URSCRIPT, KRL, RAPID, FANUC_LS)


@dataclass(frozen=True, eq=False)
class CorrectedProgram:
    """`diff` unified, line by line; `names` of the targets, one a row of `found`, and of their frames, empty for joint
    targets; `frames` (target, 4, 4) in the base.

    `skipped`: sentences on the others; `kept`: names of joint targets, which stay; `warnings`: sentences on
    routines that are not in the file, and on moves along a line from a target that is corrected to one that is not, or
    the reverse.
    """

    text: str
    diff: tuple[str, ...]
    names: tuple[str, ...]
    frame_names: tuple[str, ...]
    frames: Floats
    found: Corrected
    skipped: tuple[str, ...]
    kept: tuple[str, ...]
    warnings: tuple[str, ...]
    pieces: tuple[tuple[int, int, str], ...]  # from, to in the text that was given, and what stands there now

    def placed(self, at: int) -> int:
        """Where a place between the lines of the text that was given is now."""
        return at + sum(len(new) - (end - begin) for begin, end, new in self.pieces if end <= at)


def dialect_of(suffix: str) -> Dialect | None:
    """By the end of a file's name; None: no program."""
    return next((d for d in DIALECTS if suffix.lower() in d.suffixes), None)


def correct_program(
    model: ModelFile,
    text: str,
    dialect: Dialect,
    frame: Floats | None,
    near_rad: Floats | None,
    every: dict[str, float],
    inverse_of: Inverse,
    options: Options,
    name: str,
) -> CorrectedProgram:
    """`frame` (4, 4): of coordinates in the base, where the program does not hold it. `near_rad` (joint,): posture
    before the first target. `every`: conditions of all targets.

    DataError where there is no target that could be corrected, or one `frame` or tool stands for several.
    """
    arms = Arms.of(model, options)
    targets = examined(dialect.find(text, arms.n_joints), text, dialect, options.joint_targets)
    every_target = targets.literals
    kept = tuple(one.name for one in targets.literals if one.joints and not options.joint_targets)
    some = tuple(one for one in targets.literals if options.joint_targets or not one.joints)
    if kept and not some:
        raise DataError(f"{name}: {nothing_but_joints(targets, len(kept))}")
    targets, base, tool = stated(replace(targets, literals=some), text, frame, options.tool, arms.stated_tool, name)
    names, options = _named(targets.literals, replace(options, tool=tool))
    arms = Arms.of(model, options)
    _check(targets, dialect, options, text, name)
    if not all((np.abs(T[..., :3, :]) <= LENGTH_M).all() for T in (base, tool) if T is not None):
        raise DataError(f"{name}: a frame or tool has a number beyond {LENGTH_M / 1e3:g} km; correct it")
    wanted = _wanted(targets.literals, dialect, arms, base, near_rad, every)
    for row, joints_rad in _behind_joints(every_target, targets.literals, dialect):
        wanted.near_rad[row] = wanted.near_rad[row] if targets.literals[row].near else joints_rad
    found = correct(model, replace(wanted, source=name), inverse_of, options)
    pieces, q_rad = list[tuple[int, int, str]](), found.q_rad.copy()
    in_base = inverse(base) @ found.T_base_tool
    for row, one in enumerate(targets.literals):
        if not np.isfinite(found.q_rad[row]).all():
            continue
        if one.joints:
            written = dialect.joint_numbers(found.q_rad[row])
            q_rad[row] = dialect.joints_rad([float(v) for v in written])
        else:
            written = dialect.pose_numbers(in_base[row, :3, 3], in_base[row, :3, :3])
            q_rad[row] = _commanded(arms, dialect, base[row], written, found.q_rad[row], inverse_of)
        pieces += [(*span, number) for span, number in zip(one.spans, written, strict=True)]
        pieces += [(*span, number) for span, number in (one.turns(found.q_rad[row]) if one.turns else ())]
        if found.via_rad is not None and dialect.overshoot is not None:
            joints = dialect.joint_numbers(found.via_rad[row])
            ending = "\r\n" if "\r\n" in text else "\n"
            pieces += [(m.line_start, m.line_start, dialect.overshoot(m, joints) + ending) for m in one.moves]
    conditions = moves_conditions(wanted, found.nominal_rad, options)
    after, _, _ = predicted_errors(model, wanted, q_rad, conditions, options)
    new = _replaced(text, pieces)
    changes = difflib.unified_diff(text.splitlines(), new.splitlines(), name, "corrected", lineterm="", n=0)
    found = replace(found, q_rad=q_rad, after=after)
    warnings = (*targets.absent, *_seams(text, targets, [bool(np.isfinite(joints).all()) for joints in q_rad]))
    return CorrectedProgram(new, tuple(changes), *names, base, found, targets.skipped, kept, warnings, tuple(pieces))


def _named(literals: Sequence[Literal], options: Options) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], Options]:
    """Names of the targets and of their frames; the options with that of their tool."""
    uses = [(one.joints, *one.used) for one in literals]
    frames = tuple("" if joints else _called(places[0]) for joints, places, _ in uses)
    tool = next((tools[0].name for joints, _, tools in uses if not joints), "")
    return (tuple(one.name for one in literals), frames), replace(options, tool_name=tool)


def _called(place: NamedPose) -> str:
    """For a person: nobody measures the robot's base, but the parts in it."""
    own = place.T is not None and OWN.fullmatch(place.name)
    return f"parts in the robot's own base ({place.name})" if own else place.name or "the frame of --frame"


def _behind_joints(every: Sequence[Literal], some: Sequence[Literal], dialect: Dialect) -> Iterator[tuple[int, Floats]]:
    """Rows of the targets that come next after a joint target which stays, and its joints: the posture before them."""
    row_of = {one.at: row for row, one in enumerate(some)}
    for before, after in pairwise(every):
        if before.joints and before.at not in row_of and after.at in row_of:
            yield row_of[after.at], dialect.joints_rad(before.numbers)


def _seams(text: str, targets: Targets, done: Sequence[bool]) -> tuple[str, ...]:
    """Where a move along a line or an arc begins at a target that is corrected and ends at one that is not."""
    lines = {
        line_of(text, move.line_start): ok for one, ok in zip(targets.literals, done, strict=True) for move in one.moves
    }
    written, found = text.splitlines(), filter(None, map(LINE.match, targets.skipped))
    lines |= {n: False for n in (int(match[1]) for match in found) if not ASSIGNS.match(written[n - 1])}
    order = sorted(lines)
    return tuple(
        f"lines {a} and {b}: the one target is corrected, the other is not; the seam between them is neither as taught "
        "nor as planned"
        for a, b in pairwise(order)
        if lines[a] != lines[b] and ALONG.search(written[b - 1])
    )


def _check(targets: Targets, dialect: Dialect, options: Options, text: str, name: str) -> None:
    if not targets.literals:
        raise DataError(f"{name}: {nothing_corrected(targets, text, dialect)}")
    if far := next((one for one in targets.literals if not _in_bounds(one, dialect)), None):
        raise DataError(
            f"{name}: {shown(far.name, 40)} has a number beyond {LENGTH_M / 1e3:g} km or {ANGLE_RAD:g} rad; correct it"
        )
    idle = [one.name for one in targets.literals if not one.moves]
    if options.approach and idle:
        raise DataError(
            f"{name}: no move in this file goes to {', '.join(idle[:3])}, before which an overshoot point could stand; "
            "leave --approach out"
        )
    if options.approach and dialect.overshoot is None:
        raise DataError(f"{name}: overshoot points cannot be inserted into {dialect.name}; leave --approach out")
    if options.approach:
        _check_overshoots([move for one in targets.literals for move in one.moves], text, name)


def _check_overshoots(moves: Sequence[Move], text: str, name: str) -> None:
    """A move before an arc, within a spline, or to another target than the next one would lead along another path."""
    marks = {mark.start(): (mark["end"] or "").upper() != "END" for mark in SPLINE.finditer(text)}
    inside, starts, targets = list(marks.values()), list(marks), Counter(move.line_start for move in moves)
    for move in moves:
        spline, arc = last_before(inside, starts, move.line_start, False), ARC.search(re.split("[;#!]", move.text)[0])
        if spline or arc or not move.alone or targets[move.line_start] > 1:
            one = "to one of several targets" if move.alone else "of an IF, or behind another instruction, in its line"
            why = "within a spline" if spline else "along an arc" if arc else one
            line = f"{name}: line {line_of(text, move.line_start)}"
            raise DataError(f"{line}: no overshoot point can stand before a move {why}; leave --approach out")


def _in_bounds(one: Literal, dialect: Dialect) -> bool:
    """Whether what is written could be lengths and angles."""
    sizes = np.abs(one.numbers)
    lengths_m, angles_rad = (sizes[:0], sizes) if one.joints else (sizes[:3], sizes[3:])
    if dialect.mm:
        lengths_m, angles_rad = 1e-3 * lengths_m, np.radians(angles_rad)
    return bool(np.all(lengths_m <= LENGTH_M) and np.all(angles_rad <= ANGLE_RAD))


def _wanted(
    literals: tuple[Literal, ...],
    dialect: Dialect,
    arms: Arms,
    base: Floats,
    near_rad: Floats | None,
    every: dict[str, float],
) -> Wanted:
    """A program may visit its targets in any order: none is known to be reached from the one before."""
    n = len(literals)
    T, joints = np.empty((n, 4, 4)), np.full((n, arms.n_joints), np.nan)
    near = np.full((n, arms.n_joints), np.nan)
    if near_rad is not None and n:
        near[0] = near_rad
    for row, one in enumerate(literals):
        if one.joints:
            joints[row] = dialect.joints_rad(one.numbers)
            T[row] = wanted_joints(arms, joints[[row]])[0]
        else:
            T[row] = base[row] @ dialect.frame(one.numbers)
            if len(one.near) == arms.n_joints:
                near[row] = dialect.joints_rad(one.near)
    branches = tuple(one.branch for one in literals)
    return Wanted(T, joints, near, {c: np.full(n, v) for c, v in every.items()}, False, branches)


def _commanded(
    arms: Arms, dialect: Dialect, base: Floats, written: list[str], near_rad: Floats, inverse_of: Inverse
) -> Floats:
    """(joint,) to which a controller with the rig file's arm goes for a pose as it is written."""
    goal = base @ dialect.frame([float(v) for v in written]) @ inverse(arms.stated_tool)
    q_rad, found = inverse_of.refined(arms.drawn, goal[None], near_rad[None])
    return q_rad[0] if found[0] else np.full_like(near_rad, np.nan)


def _replaced(text: str, pieces: list[tuple[int, int, str]]) -> str:
    """The text with each piece in place of what stood between its two places."""
    out, last = list[str](), 0
    for begin, end, new in sorted(pieces, key=lambda piece: (piece[0], piece[1])):
        out += [text[last:begin], new]
        last = end
    return "".join([*out, text[last:]])
