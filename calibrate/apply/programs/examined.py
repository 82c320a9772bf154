"""What no dialect may pass over: motion whose target is not read, and axes beside those of the arm.

A target is a pose of the tool in a frame. Where an external axis carries the arm (a track) or the part (a positioner),
the place of this frame in the arm's base depends on that axis, and a program does not state how: such targets are left.
"""

import re
from collections.abc import Iterator
from dataclasses import replace

from acquisition.recording.files import shown
from calibrate.apply.programs.literal import (
    Dialect,
    Literal,
    Targets,
    blanked,
    line_of,
)

LINE = re.compile(r"line (\d+)\b")
LISTED = 1  # reasons in one error, which has room for few
LONGEST_SHOWN = 40  # letters of an instruction


def examined(targets: Targets, text: str, dialect: Dialect, joint_targets: bool) -> Targets:
    """Without targets beside an external axis; with a sentence on each of them, and on motion that was not read.

    `joint_targets`: whether joint targets are corrected, too; those that stay need no sentence.
    """
    skipped = [*targets.skipped, *_unread_motion(targets, text, dialect)]
    kept: list[Literal] = []
    moved = _moved_axes(targets)
    for one in targets.literals:
        why = "" if one.joints and not joint_targets else _beside_axis(one, moved)
        if why:
            line = f"line {line_of(text, one.at)}"
            skipped.append(f"{line}: {'' if one.name == line else one.name + ': '}{why}; not corrected")
        else:
            kept.append(one)
    return replace(targets, literals=tuple(kept), skipped=tuple(skipped))


def nothing_corrected(targets: Targets, text: str, dialect: Dialect) -> str:
    """Why no target of a program can be corrected: which motion it holds, and the first reasons."""
    lines = _motion_lines(text, dialect)
    first = min(lines, default=0)
    held = "no motion instruction is in it"
    if lines:
        held = f"{len(lines)} motion instructions are in it, first in line {first}: {lines[first]}"
    return "; ".join([f"no target of {dialect.name} that could be corrected", held, *_reasons(targets)])


def nothing_but_joints(targets: Targets, count: int) -> str:
    """Why no target of a program is corrected where `count` joint targets are all that can be."""
    only = "other" if targets.skipped else "all"
    held = f"{only} {count} targets are joint targets, which stay as they are; --joint-targets"
    return "; ".join([*_reasons(targets), held])


def _reasons(targets: Targets) -> list[str]:
    found = sorted(targets.skipped, key=_line)
    more = len(found) - LISTED
    return [*found[:LISTED], *([f"and {more} more"] if more > 0 else [])]


def _line(sentence: str) -> int:
    """0 for a sentence on the whole file."""
    return int(match[1]) if (match := LINE.match(sentence)) else 0


def _motion_lines(text: str, dialect: Dialect) -> dict[int, str]:
    """By number, the lines in which an instruction begins that moves the arm."""
    code = blanked(text, dialect.comment)
    written = code.splitlines()
    numbers = (line_of(code, match.start("go")) for match in dialect.motion.finditer(code))
    return {n: shown(" ".join(written[n - 1].split()), LONGEST_SHOWN) for n in numbers}


def _unread_motion(targets: Targets, text: str, dialect: Dialect) -> Iterator[str]:
    """Sentences on motion that is neither a move to a target that was found, nor listed."""
    listed = [LINE.match(sentence) for sentence in targets.skipped]
    if not targets.literals and not all(listed):  # the whole file is refused
        return
    moves = [*targets.moves, *(move for one in targets.literals for move in one.moves)]
    read = {line_of(text, move.line_start) for move in moves}
    read |= {int(match[1]) for match in listed if match}
    for line, instruction in _motion_lines(text, dialect).items():
        if line not in read:
            yield f"line {line}: {instruction}: the form of this move is not known; not corrected"


def _moved_axes(targets: Targets) -> dict[str, float]:
    """External axes that a target has elsewhere than at 0, and where."""
    stated = [axis for one in targets.literals for axis in one.external]
    return {name: value for name, value in (*stated, *targets.external) if value != 0.0}


def _beside_axis(one: Literal, moved: dict[str, float]) -> str:
    """Why a target cannot be corrected beside the external axes of its program; empty where it can."""
    own = dict(one.external)
    for name, elsewhere in sorted(moved.items()):
        where = "is computed" if elsewhere != elsewhere else f"is at {elsewhere:g}"
        if name not in own:
            return f"external axis {name} {where} for other targets, and this one does not state it"
        if own[name] == 0.0:
            return f"external axis {name} moves: it is at 0 here, and {where.removeprefix('is ')} for other targets"
        place = "is computed" if own[name] != own[name] else f"is at {own[name]:g}"
        return f"external axis {name} {place}: where it carries the arm or the part is not known"
    return ""
