"""The target (reflector, wire eye, probe tip) on the flange: a point with three unknowns, and how points move."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.parameters import Parameter
from calibrate.model.placement.shared_points import SharedPoints
from calibrate.model.rigid import cross_matrix
from calibrate.model.sensor_model import About

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

POINT_PLAUSIBLE_M = 5e-3  # a bracket or stylus fitted by hand, against the drawing
UNKNOWN_PLAUSIBLE_M = 0.2  # where the target sits is not stated: somewhere about the flange
N_PARAMETERS = 3
TARGETS = "target"  # parameters of several are target<id>.x, ...


@dataclass(frozen=True)
class Target:
    """Assumed point in the flange frame; its parameters are corrections to it."""

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

    def by_correction(self, R_flange: Floats) -> Floats:
        """(pose, k, 3) derivative, by the corrections, of what turns with the flange as R_flange (pose, k, 3)."""
        return R_flange

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same at some of the poses."""
        return self


@dataclass(frozen=True)
class SeveralTargets:
    """Several points in the flange frame, one at a pose; parameters are corrections to each, point by point."""

    points: SharedPoints  # target -> (3,) in the flange

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.points.parameters

    def about(self) -> About:
        """Points in the flange that the corrections start from."""
        return self.points.about()

    def placed(self, about: About) -> Self:
        """The same where a model's corrections start from."""
        return replace(self, points=self.points.placed(about))

    def in_base(self, shifts: Floats, T_base_flange: Floats) -> Floats:
        """(pose, 3) each pose's target in the base for corrections (3 target,) and flange poses (pose, 4, 4)."""
        at = self.points.at_poses_m(shifts)
        return np.einsum("nij,nj->ni", T_base_flange[:, :3, :3], at) + T_base_flange[:, :3, 3]

    def by_correction(self, R_flange: Floats) -> Floats:
        """(pose, k, 3 target) derivative by the corrections; R_flange (pose, k, 3) as above."""
        return self.points.by_shift(R_flange)

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same at some of the poses."""
        return replace(self, points=self.points.select(rows))


def targets_of(rig: Rig, target: Ints) -> SeveralTargets:
    """The [[target]] of each pose (pose,), nominal. DataError for one that the rig does not have."""
    points = {k: np.array(t.point_m) for k, t in rig.targets.items()}
    return SeveralTargets(SharedPoints(TARGETS, points, target, POINT_PLAUSIBLE_M))


def point_by_twist(point_m: Floats) -> Floats:
    """(..., 3, 6) derivative of a point (..., 3) of a body by the body's twist [v; w]: v + w x p."""
    out = np.zeros((*point_m.shape, 6))
    out[..., range(3), range(3)] = 1.0
    out[..., 3:] = -cross_matrix(point_m)
    return out
