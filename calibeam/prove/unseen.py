"""The poses that are asked, and the answer: where two models put the tool there.

A model that cannot say it leaves its part out.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibeam.prove.unseen_poses import Beam, Tool

Floats = NDArray[np.float64]


def write_asked(free_space: Mapping[str, Any], path: Path) -> None:
    """Joint readings and the side from which each joint came: standing, unloaded, as warm as at the first sample."""
    readings, approach = free_space["reading_rad"], free_space["approach"]
    joints = range(1, len(readings[0]) + 1)
    lines = [",".join([*(f"q{j}_rad" for j in joints), *(f"approach{j}" for j in joints)])]
    lines += [",".join(map(repr, [*q, *a])) for q, a in zip(readings, approach, strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_asked(path: Path) -> tuple[Floats, Floats]:
    """Joint readings and approach, both (pose, joint), as the concealing side wrote them."""
    q_rad, approach = np.hsplit(np.loadtxt(path, delimiter=",", skiprows=1), 2)
    return q_rad, approach


def write_unseen(path: Path, before: Tool | None, after: Tool | None) -> None:
    """Geometry alone, and with the physics found."""
    parts: dict[str, Floats] = {}
    for name, tool in (("before", before), ("after", after)):
        if isinstance(tool, Beam):
            parts |= {f"{name}_origin_m": tool.origin_m, f"{name}_direction": tool.direction}
        elif tool is not None:
            parts[f"{name}_tip_m"] = tool
    np.savez(path, **parts)  # pyright: ignore[reportArgumentType] - its keyword `allow_pickle` is not among them


def read_unseen(path: Path) -> tuple[Tool | None, Tool | None]:
    """What `write_unseen` wrote; nothing where there is no file."""
    if not path.is_file():
        return None, None
    with np.load(path) as parts:
        kept = {name: np.asarray(parts[name], dtype=np.float64) for name in parts.files}
    return _tool_in(kept, "before"), _tool_in(kept, "after")


def _tool_in(parts: dict[str, Floats], name: str) -> Tool | None:
    if f"{name}_origin_m" in parts:
        return Beam(parts[f"{name}_origin_m"], parts[f"{name}_direction"])
    return parts.get(f"{name}_tip_m")
