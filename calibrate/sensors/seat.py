"""Instrument: a probe in cones. In one seat, from whatever side, the tip is at one point; which one nobody knows.

Observed at a pose: tip less seat (m), which is zero. Cones hold no scale: an arm shrunk to nothing satisfies them all.
So weights must be the joints' noise mapped through the arm (calibrate/variance.py), and one known length is needed.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.parameters import Parameter
from calibrate.sensors.shared_points import SharedPoints
from calibrate.sensors.target import Target, point_by_twist

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PLAUSIBLE_M = 0.05  # about the mean of the nominal tips: nominal arms are off by millimetres, hand-made tools by more


@dataclass(frozen=True)
class Seat:
    """Pose j sits in cone `seat[j]`. Parameters: target 3, then those of the seats."""

    target: Target
    points: SharedPoints

    unit = "m"

    @property
    def seat(self) -> Ints:
        """(pose,) number of the cone."""
        return self.points.of_pose

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.points.parameters

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, points=self.points.select(rows))

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return self.target.in_base(phi[:3], T_base_flange) - self.points.at_poses_m(phi[3:])

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return point_by_twist(self.target.in_base(phi[:3], T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        by_seat = self.points.by_shift(np.broadcast_to(-np.eye(3), (len(self.seat), 3, 3)))
        return np.concatenate([T_base_flange[:, :3, :3], by_seat], axis=-1)


def mean_tips(tips_m: Floats, seat: Ints) -> SharedPoints:
    """The cones, each from the mean of its nominal tips (pose, 3). DataError for a seat with one pose only."""
    out: dict[int, Floats] = {}
    for k in sorted(set(seat.tolist())):
        rows = np.flatnonzero(seat == k)
        if len(rows) < 2:
            raise DataError(
                f"seat {k}: 1 row; one articulation says nothing, take it again from other sides or drop it"
            )
        out[k] = tips_m[rows].mean(axis=0)
    return SharedPoints("seat", out, seat, PLAUSIBLE_M)
