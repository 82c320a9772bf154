"""The target (reflector, wire eye, probe tip) on the flange: a point with three unknowns, and how points move."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter
from calibrate.rigid import cross_matrix
from calibrate.sensors.model import About

Floats = NDArray[np.float64]

POINT_PLAUSIBLE_M = 5e-3  # a bracket or stylus fitted by hand, against the drawing
UNKNOWN_PLAUSIBLE_M = 0.2  # nobody says where the target sits: somewhere about the flange
N_PARAMETERS = 3


@dataclass(frozen=True)
class Target:
    """Believed point in the flange frame; its parameters are corrections to it."""

    point_m: Floats  # (3,)
    plausible_m: float = POINT_PLAUSIBLE_M
    name: str = "tool"  # first part of the names of its parameters

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"{self.name}.{a}", "m", self.plausible_m) for a in "xyz")

    def about(self) -> About:
        """Point in the flange that the corrections start from."""
        return {self.name: tuple(self.point_m.tolist())}

    def placed(self, about: About) -> Self:
        """The same where a model's corrections start from."""
        found = about.get(self.name)
        return self if found is None else replace(self, point_m=np.array(found[:3]))

    def in_base(self, tool: Floats, T_base_flange: Floats) -> Floats:
        """(pose, 3) the target in the base for corrections (3,) and flange poses (pose, 4, 4)."""
        return T_base_flange[:, :3, :3] @ (self.point_m + tool) + T_base_flange[:, :3, 3]


def point_by_twist(point_m: Floats) -> Floats:
    """(..., 3, 6) derivative of a point (..., 3) of a body by the body's twist [v; w]: v + w x p."""
    out = np.zeros((*point_m.shape, 6))
    out[..., range(3), range(3)] = 1.0
    out[..., 3:] = -cross_matrix(point_m)
    return out
