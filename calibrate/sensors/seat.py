"""Instrument: a probe in cones. In one seat, from whatever side, the tip is at one point; which one nobody knows.

Observed at a pose: tip less seat (m), which is zero. Cones hold no scale: an arm shrunk to nothing satisfies them all.
So weights must be the joints' noise mapped through the arm (calibrate/variance.py), and one known length is needed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.parameters import Parameter
from calibrate.sensors.target import Target, point_by_twist

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PLAUSIBLE_M = 0.05  # about the mean of the nominal tips: nominal arms are off by millimetres, hand-made tools by more


@dataclass(frozen=True)
class Seat:
    """Pose j sits in cone `seat[j]`. Parameters: target 3, then 3 of each seat: shifts of its start in the base."""

    target: Target
    start_m: Mapping[int, Floats]  # seat -> (3,) in the base
    seat: Ints  # (pose,)

    unit = "m"

    def __post_init__(self) -> None:
        unknown = set(self.seat.tolist()) - set(self.start_m)
        if unknown:
            raise DataError(f"seat {min(unknown)} has no start point; give one for every seat of the data")

    @cached_property
    def seats(self) -> tuple[int, ...]:
        """Seats in the order of their parameters."""
        return tuple(sorted(self.start_m))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        used = set(self.seat.tolist())
        points = (Parameter(f"seat{k}.{a}", "m", PLAUSIBLE_M, free=k in used) for k in self.seats for a in "xyz")
        return self.target.parameters + tuple(points)

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, seat=self.seat[rows])

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return self.target.in_base(phi[:3], T_base_flange) - self.points_m(phi)[self._index]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return point_by_twist(self.target.in_base(phi[:3], T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        n = len(self.seat)
        by_seat = np.zeros((n, 3, len(self.seats), 3))
        for axis in range(3):
            by_seat[range(n), axis, self._index, axis] = -1.0
        return np.concatenate([T_base_flange[:, :3, :3], by_seat.reshape(n, 3, -1)], axis=-1)

    def points_m(self, phi: Floats) -> Floats:
        """(seat, 3) the seats in the base."""
        return np.stack([self.start_m[k] for k in self.seats]) + phi[3:].reshape(-1, 3)

    @cached_property
    def _index(self) -> NDArray[np.intp]:
        return np.searchsorted(np.array(self.seats), self.seat)


def mean_tips(tips_m: Floats, seat: Ints) -> dict[int, Floats]:
    """Start point of every seat: the mean of its nominal tips (pose, 3). DataError for a seat with one pose only."""
    out: dict[int, Floats] = {}
    for k in sorted(set(seat.tolist())):
        rows = np.flatnonzero(seat == k)
        if len(rows) < 2:
            raise DataError(
                f"seat {k}: 1 row; one articulation says nothing, take it again from other sides or drop it"
            )
        out[k] = tips_m[rows].mean(axis=0)
    return out
