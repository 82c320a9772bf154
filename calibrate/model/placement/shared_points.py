"""Points in the base that are unknown and that several poses share: cones, or where centred beams meet."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.parameters import Parameter
from calibrate.model.sensor_model import About

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
