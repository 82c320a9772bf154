"""Instrument: a laser line through one unknown point, such as the one where both orders of a centred fixture meet.

Observed at a pose: how far the point lies beside the beam (m), along both axes across the drawn beam, which is zero.
Source of the constraint: Deng, Ding, Zhang, Food & Machinery 2019(3); here the point is an unknown, and the offsets
are taken where the beam passes it, so that each pose gives two equations of its own.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.samples import SPOTS
from calibrate.errors import DataError
from calibrate.model.chain import SensorChain, Usage
from calibrate.model.observations import observations
from calibrate.model.optics.laser import CENTRED_M, LaserMount, Lines, nearest_point
from calibrate.model.parameters import Parameter
from calibrate.model.placement import SharedPoints
from calibrate.model.problem import Measured
from calibrate.model.rigid import cross
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors import spots
from calibrate.model.sensors.kind import NoiseSource, SensorKind
from calibrate.model.sensors.spots import laser_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

POINTS = "point"  # parameters are point<k>.x, ...
LINE_ASSUMED_M = 5e-6  # how well the servo centres a spot
POINT_PLAUSIBLE_M = 0.05  # about the point nearest to the nominal lines


@dataclass(frozen=True)
class PointLine(Usage):
    """The beam of pose j passes the point of pose j. Parameters: laser mount 4, then those of the points."""

    mount: LaserMount
    points: SharedPoints

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.mount.parameters + self.points.parameters

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, points=self.points.select(rows))

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        off_m, travel_m = self._off_line(phi, T_base_flange)
        return off_m - phi[:2] - travel_m[:, None] * phi[2:4]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """The flange moving by a twist is the point moving by its opposite."""
        seen = self._across(phi) @ np.swapaxes(T_base_flange[:, :3, :3], 1, 2)  # (pose, 2, 3)
        point = self.points.at_poses_m(phi[4:])
        out = np.empty((len(T_base_flange), 2, 6))
        out[..., :3] = -seen
        out[..., 3:] = cross(seen, point[:, None])  # -a . (w x p) = (a x p) . w
        return out

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        _, travel_m = self._off_line(phi, T_base_flange)
        by_mount = np.zeros((len(T_base_flange), 2, 4))
        by_mount[:, range(2), range(2)] = -1.0
        by_mount[:, range(2), range(2, 4)] = -travel_m[:, None]
        seen = self._across(phi) @ np.swapaxes(T_base_flange[:, :3, :3], 1, 2)
        return np.concatenate([by_mount, self.points.by_shift(seen)], axis=-1)

    def _across(self, phi: Floats) -> Floats:
        """(2, 3) derivative of the observation by the point, both in the flange frame."""
        m = self.mount
        return np.stack([m.u - phi[2] * m.direction, m.v - phi[3] * m.direction])

    def _off_line(self, phi: Floats, T_base_flange: Floats) -> tuple[Floats, Floats]:
        """(pose, 2) offsets from, and (pose,) travel along the nominal beam."""
        m = self.mount
        point = self.points.at_poses_m(phi[4:])
        R = T_base_flange[:, :3, :3]
        in_flange = np.einsum("nji,nj->ni", R, point - T_base_flange[:, :3, 3]) - m.origin_m
        return in_flange @ np.stack([m.u, m.v], axis=1), in_flange @ m.direction


def meeting_points(mount: LaserMount, T_base_flange: Floats, point: Ints) -> SharedPoints:
    """The points, each from nearest to the nominal lines that pass it. DataError where these are parallel or one."""
    beam = mount.beam(np.zeros(4), T_base_flange)
    out: dict[int, Floats] = {}
    for k in sorted(set(point.tolist())):
        rows = np.flatnonzero(point == k)
        direction = beam.direction[rows]
        if len(rows) < 2 or np.linalg.norm(cross(direction[:1], direction), axis=1).max() < 1e-3:
            raise DataError(f"point {k}: {len(rows)} lines, all parallel; take poses that cross there at an angle")
        none = np.zeros((len(rows), 3, 0))
        out[k] = nearest_point(Lines(beam.origin_m[rows], direction, none, none))[0]
    return SharedPoints(POINTS, out, point, POINT_PLAUSIBLE_M)


def _build(table: SampleTable) -> Measured | None:
    if len(table.filled(*SPOTS)) == 0:
        return None
    seen = observations(table.samples, table.angles)
    centred = np.flatnonzero(np.abs(seen.spots_m).max(axis=1) <= CENTRED_M)
    rows, place = table.filled(*SPOTS)[centred], seen.placement[centred]
    if len(rows) == 0:
        raise DataError(
            f"samples: no row has all spots within {CENTRED_M} m of the centres; centre poses, or use spots"
        )
    mount = laser_of(table.rig)
    sensor = PointLine(mount, meeting_points(mount, table.T_base_flange[rows], place))
    own = {KIND.noise[0].name: np.full((len(rows), 2), LINE_ASSUMED_M)}
    return table.measured(
        KIND.name, SensorChain(table.arm, sensor), rows, np.zeros((len(rows), 2)), own, condition=True
    )


KIND = SensorKind(
    name="point",
    columns=SPOTS,
    title="Lines of centred spots",
    noun="lines of centred spots",
    noise=(NoiseSource("line", "m"),),
    instead_of=(spots.KIND.name,),
    build=_build,
)
