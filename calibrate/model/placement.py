"""Where things stand: the device in the base, targets on the flange, points that several poses share.

Shared points lie in the base: cones, or where centred beams meet. The target (reflector, wire eye, probe tip) is a
point of the flange with three unknowns. The device (tracker, camera, drum) is a frame with six; its corrections are
shifts along, and a rotation vector about, its own assumed axes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.chain import About
from calibrate.model.parameters import Parameter
from calibrate.model.rigid import cross_matrix, pose_offset, pose_offset_twists, transform

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
POINT_PLAUSIBLE_M = 5e-3  # a bracket or stylus fitted by hand, against the drawing
UNKNOWN_PLAUSIBLE_M = 0.2  # where the target sits is not stated: somewhere about the flange
TARGETS = "target"  # parameters of several are target<id>.x, ...
PLAUSIBLE_M = 0.05  # a start found in closed form, or taken from the rig: nominal arms are off by millimetres
PLAUSIBLE_RAD = 0.05
AXES = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class SharedPoints:
    """Parameters are the shifts x, y, z of every point from its start, along the base's axes, point by point."""

    kind: str  # "seat": parameters are seat<k>.x, ...
    start_m: Mapping[int, Floats]  # point -> (3,) in the base
    of_pose: Ints  # (pose,)
    plausible_m: float

    def __post_init__(self) -> None:
        unknown = set(self.of_pose.tolist()) - set(self.start_m)
        if unknown:
            raise DataError(
                f"{self.kind} {min(unknown)} has no start point; give one for every {self.kind} of the data"
            )

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """Points in the order of their parameters."""
        return tuple(sorted(self.start_m))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Free where any pose has the point."""
        used = set(self.of_pose.tolist())
        return tuple(
            Parameter(f"{self.kind}{k}.{a}", "m", self.plausible_m, free=k in used) for k in self.numbers for a in "xyz"
        )

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same points, of some of the poses."""
        return replace(self, of_pose=self.of_pose[rows])

    def about(self) -> About:
        """Points in the base that the corrections start from."""
        return {f"{self.kind}{k}": tuple(point.tolist()) for k, point in self.start_m.items()}

    def placed(self, about: About) -> Self:
        """The same where a model's corrections start from."""
        return replace(self, start_m={k: np.array(about.get(f"{self.kind}{k}", at)) for k, at in self.start_m.items()})

    def at_poses_m(self, shifts_m: Floats) -> Floats:
        """(pose, 3) in the base, for shifts (3 * point,)."""
        return (np.stack([self.start_m[k] for k in self.numbers]) + shifts_m.reshape(-1, 3))[self._index]

    def by_shift(self, by_point: Floats) -> Floats:
        """(pose, k, 3 * point) derivative by the shifts, from that by each pose's own point (pose, k, 3)."""
        out = np.zeros((*by_point.shape[:2], len(self.numbers), 3))
        out[range(len(by_point)), :, self._index] = by_point
        return out.reshape(*by_point.shape[:2], 3 * len(self.numbers))

    @cached_property
    def _index(self) -> NDArray[np.intp]:
        return np.searchsorted(np.array(self.numbers), self.of_pose)


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


@dataclass(frozen=True)
class Device:
    """Assumed place; `prior` (m, rad) is one sigma of it, None: no opinion, the data find it."""

    T_base_device: Floats  # (4, 4)
    prior: tuple[float, float] | None = None
    name: str = "device"  # first part of the names of its parameters

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(self._parameter(i, a) for i, a in enumerate(AXES))

    @property
    def origin_parameters(self) -> tuple[Parameter, ...]:
        """Of an instrument that knows only a point of the device: shifts, along the assumed axes."""
        return self.parameters[:3]

    def T_base_device_at(self, deviation: Floats) -> Floats:
        """(4, 4) the frame for corrections (6,)."""
        return self.T_base_device @ pose_offset(deviation)

    def origin_m(self, shift_m: Floats) -> Floats:
        """(3,) the device's origin in the base for corrections (3,)."""
        return self.T_base_device[:3, 3] + self.T_base_device[:3, :3] @ shift_m

    def seen_by_parameter(self, deviation: Floats, point_m: Floats) -> Floats:
        """(pose, 3, 6) derivative, by the corrections, of base points (pose, 3) as the device sees them.

        The device moving by a twist is the point moving by its opposite.
        """
        R = self.T_base_device_at(deviation)[:3, :3]
        return -(R.T @ point_by_twist(point_m) @ pose_offset_twists(self.T_base_device, deviation))

    def about(self) -> About:
        """Origin and rotation vector in the base that the corrections start from."""
        T = self.T_base_device
        return {self.name: (*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist())}

    def placed(self, about: About) -> Self:
        """The same where a model's corrections start from."""
        found = about.get(self.name)
        return self if found is None else replace(self, T_base_device=transform(found[:3], found[3:]))

    def _parameter(self, i: int, axis: str) -> Parameter:
        unit, plausible = ("m", PLAUSIBLE_M) if i < 3 else ("rad", PLAUSIBLE_RAD)
        if self.prior is None:
            return Parameter(f"{self.name}.{axis}", unit, plausible)
        return Parameter(f"{self.name}.{axis}", unit, max(plausible, self.prior[i // 3]), prior=self.prior[i // 3])
