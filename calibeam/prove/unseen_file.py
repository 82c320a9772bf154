"""unseen.npz: where two models put the tool at the poses asked. A model that cannot say it leaves its part out."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calibeam.prove.unseen_poses import Beam, Tool

Floats = NDArray[np.float64]


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
    return _tool(kept, "before"), _tool(kept, "after")


def _tool(parts: dict[str, Floats], name: str) -> Tool | None:
    if f"{name}_origin_m" in parts:
        return Beam(parts[f"{name}_origin_m"], parts[f"{name}_direction"])
    return parts.get(f"{name}_tip_m")
