"""Where the frames and tools of a program are: one rule for all dialects.

What the file declares is used. What it only names, or leaves to the state of the controller, the user states for the
whole file; a target whose frame or tool is known to neither is left as it is, with the remedy. A tool that is not named
at all is that of the rig file.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.correct.programs.literal import Literal, NamedPose, Targets, line_of
from calibrate.errors import DataError

Floats = NDArray[np.float64]

SAME = 2e-6  # m and of a rotation matrix: rounding of what is written


@dataclass(frozen=True)
class _Kind:
    name: str
    option: str
    unnamed: str  # the remedy where a program names none; empty: none is needed


FRAME = _Kind("frame", "--frame", "the file sets no frame before it; give it with --frame (0 0 0 0 0 0: robot's base)")
TOOL = _Kind("tool", "--tool", "")


def stated(
    targets: Targets, text: str, frame: Floats | None, tool: Floats | None, rig_tool: Floats, name: str
) -> tuple[Targets, Floats, Floats | None]:
    """Targets that can be corrected; (target, 4, 4) frame of each in the base; their tool, None for the rig file's.

    DataError where one stated frame or tool would stand for several, or for none.
    """
    of_poses = [one.used for one in targets.literals if not one.joints]
    _check_given(FRAME, frame, [place for frames, _ in of_poses for place in frames], name)
    _check_given(TOOL, tool, [place for _, tools in of_poses for place in tools], name)
    kept, bases, skipped = list[Literal](), list[Floats](), list(targets.skipped)
    names, poses = list[str](), list[Floats]()  # of the tools
    for one in targets.literals:
        base = np.eye(4)
        if not one.joints:
            used_frames, used_tools = one.used
            why = _unusable(FRAME, used_frames, frame) or _unusable(TOOL, used_tools, tool)
            if why:
                line = f"line {line_of(text, one.at)}"
                skipped.append(f"{line}: {'' if one.name == line else one.name + ': '}{why}; not corrected")
                continue
            base = _pose(used_frames[0], frame, base)
            names.append(used_tools[0].name)
            poses.append(_pose(used_tools[0], tool, rig_tool))
        kept.append(one)
        bases.append(base)
    if any(not _same(poses[0], other) for other in poses):
        raise DataError(
            f"{name}: targets have tools {_listed(set(names))}; give one of them with --tool, the rest is left alone"
        )
    if tool is None and poses and not _same(poses[0], rig_tool):
        tool = poses[0]
    return replace(targets, literals=tuple(kept), skipped=tuple(dict.fromkeys(skipped))), np.array(bases), tool


def _check_given(kind: _Kind, given: Floats | None, places: Sequence[NamedPose], name: str) -> None:
    if given is None or not places:
        return
    left_open = {place.name for place in places if place.T is None}
    if len(left_open) > 1:
        raise DataError(
            f"{name}: targets are in the {kind.name}s {_listed(left_open)}, which the file does not hold, and "
            f"{kind.option} states one; declare them in the file, or correct a file for each"
        )
    if kind is FRAME and not left_open:
        raise DataError(
            f"{name}: the frames of all targets are known ({_listed({p.name for p in places})}); leave --frame out"
        )


def _unusable(kind: _Kind, used: Sequence[NamedPose], given: Floats | None) -> str:
    """Why a target with these frames, or tools, cannot be corrected; empty where it can."""
    for place in used:
        if place.refused:
            return place.refused
        if place.T is None and given is None and (place.name or kind.unnamed):
            named = f"the pose of {place.name} is not in this file; declare it there, or give it with {kind.option}"
            return named if place.name else kind.unnamed
        if kind is TOOL and place.T is not None and given is not None and not _same(place.T, given):
            return f"the tool {place.name}, as the file declares it, is not the one of --tool"
    if any(not _same(_pose(place, given, np.eye(4)), _pose(used[0], given, np.eye(4))) for place in used):
        return (
            f"it is used in several {kind.name}s ({_listed({place.name for place in used})}); give each its own target"
        )
    return ""


def _pose(place: NamedPose, given: Floats | None, otherwise: Floats) -> Floats:
    if place.T is not None:
        return place.T
    return otherwise if given is None else given


def _same(one: Floats, other: Floats) -> bool:
    return bool(np.allclose(one, other, rtol=0.0, atol=SAME))


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(name or "not named" for name in names))
