"""Where a motion goes: the general form T6 TOOL = COORD(s) POS."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.rigid import inverse

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Place:
    """`coord` None: fixed in the base. `carried_by` names the moving coordinates: places that share it share COORD."""

    name: str
    pos: Floats  # (4, 4) of the tool in its coordinates
    tool: Floats  # (4, 4) of the tool on the flange
    coord: Callable[[float], Floats] | None = None
    carried_by: str = ""

    def coord_at(self, s_m: float) -> Floats:
        """COORD(s), (4, 4)."""
        return np.eye(4) if self.coord is None else self.coord(s_m)

    def flange_at(self, s_m: float) -> Floats:
        """T6 (4, 4) with the belt at s."""
        return self.coord_at(s_m) @ self.pos @ inverse(self.tool)
