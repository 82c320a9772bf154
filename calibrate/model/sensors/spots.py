"""Instrument: spots of a laser on the two faces of a dual PSD; the light itself is dual_psd.py and optics.py.

Its gross-error check: two spots are one line of light in the fixture, and the laser's line has to lie on it. The first
spot is a point of the line, and the second, mirrored at the first face, gives its direction: no reflection has to be
computed for an arm that points elsewhere. The rotation of the fixture is the one that brings directions best onto
directions; its shift is by least squares over distances from point to line.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS
from calibrate.errors import DataError
from calibrate.model.alignment import best_rotation
from calibrate.model.chain import SensorChain
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.checks.rough_fit import median, weights
from calibrate.model.checks.witness import (
    Otherwise,
    Strain,
    Witness,
    filled,
    stacked,
    thinned,
)
from calibrate.model.default_tolerance import pair_of
from calibrate.model.observations import observations
from calibrate.model.optics.dual_psd import DualPsd, Fixture
from calibrate.model.optics.laser import LaserMount
from calibrate.model.problem import Block, Measured
from calibrate.model.rigid import transform
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    NoiseSource,
    SensorKind,
    Trait,
)
from calibrate.model.sensors.known_distance import distances_between

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PLACED = ("placement", "first_psd")  # columns that state how the fixture stood and was struck
PSD_ASSUMED_M = 2e-6  # a PSD in shop conditions (Deng, Ding, Zhang, Food & Machinery 2019(3))
FEWEST_POSES = 12  # of one placement: four numbers each, six unknowns
TURNS = 10
DAMPING = 1e-6  # of the mean square of a column: along lines all alike a fixture stays where it is assumed
LEVER_M = 0.3  # a turned fixture counts by what it moves at this distance: the usual travel of the beam


@dataclass(frozen=True)
class SpotsWitness:
    """Every fixture's place is found; it should not have to be far from where it is assumed."""

    q_rad: Floats  # (pose, joint)
    spots_m: Floats  # (pose, 4) x, y on PSD 1, x, y on PSD 2
    placement: Ints  # (pose,)
    first_psd: Ints  # (pose,) 1 or 2
    T_psd1_psd2: Floats  # (4, 4)
    T_base_psd1: Mapping[int, Floats]
    origin_m: Floats  # (3,) of the laser in the flange frame
    direction: Floats  # (3,) unit

    def strain(self, T_base_flange: Floats) -> Strain:
        beam = T_base_flange[..., :3, :3] @ self.direction
        origin = T_base_flange[..., :3, :3] @ self.origin_m + T_base_flange[..., :3, 3]
        near, far = self._line()
        distance, moved = np.zeros(beam.shape[:-1]), []
        for place in np.unique(self.placement):
            rows = self.placement == place
            nominal = self.T_base_psd1[int(place)]
            distance[..., rows], shift_m = _placed(
                near[rows], far[rows], origin[..., rows, :], beam[..., rows, :], nominal
            )
            moved.append(shift_m)
        return Strain(median(distance), median(np.stack(moved, axis=-1)))

    def otherwise(self) -> Iterator[Otherwise]:
        """Detectors exchanged in the order of the light, and millimetres. Mirrored axes: `mirrored_axes`
        of fit/identify/clean.py.
        """
        yield Otherwise(
            GrossErrorKind.EXCHANGED_PSD,
            "column first_psd",
            "the beam strikes the other detector first",
            "write 1 for 2 and 2 for 1",
            replace(self, first_psd=3 - self.first_psd),
        )
        yield Otherwise(
            GrossErrorKind.MILLIMETRES,
            "columns psd1_x_m, psd1_y_m, psd2_x_m, psd2_y_m",
            "spots in millimetres",
            "write metres (millimetres times 0.001)",
            replace(self, spots_m=1e-3 * self.spots_m),
        )

    def _line(self) -> tuple[Floats, Floats]:
        """(pose, 3), (pose, 3) first spot, and the second as the incoming beam would strike it unreflected; PSD 1."""
        flat = np.zeros((len(self.spots_m), 2, 3))
        flat[:, :, :2] = self.spots_m.reshape(-1, 2, 2)
        R, t = self.T_psd1_psd2[:3, :3], self.T_psd1_psd2[:3, 3]
        on_face = flat[:, 0], flat[:, 1] @ R.T + t
        first = (self.first_psd == 1)[:, None]
        near, far = np.where(first, on_face[0], on_face[1]), np.where(first, on_face[1], on_face[0])
        normal = np.where(first, [0.0, 0.0, 1.0], R[:, 2])
        return near, far - 2.0 * np.sum((far - near) * normal, axis=1, keepdims=True) * normal


def _placed(near: Floats, far: Floats, origin: Floats, beam: Floats, nominal: Floats) -> tuple[Floats, Floats]:
    """(distance (..., pose), moved (...) in m) of one fixture, its lines (pose, 3), the laser's (..., pose, 3).

    A distance is the mean of those of both points of a line from the laser's line.
    """
    weight, distance = np.ones(beam.shape[:-1]), np.zeros(beam.shape[:-1])
    turn, shift = nominal[:3, :3], nominal[:3, 3]
    along = far - near
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    points, own = np.stack([near, far]), nominal[:3, 3]
    origins, beams = origin[..., None, :, :], beam[..., None, :, :]
    for _ in range(TURNS):
        turn = best_rotation(beam, along, weight)
        gap = _across(origins - points @ np.swapaxes(turn, -1, -2)[..., None, :, :], beams)
        weighed = np.swapaxes(weight[..., None] * beam, -1, -2)
        normal = 2.0 * (weight.sum(axis=-1)[..., None, None] * np.eye(3) - weighed @ beam)
        ridge = DAMPING * np.trace(normal, axis1=-2, axis2=-1)[..., None] / 3.0
        pull = (weight[..., None, :] @ gap.sum(axis=-3))[..., 0, :]
        damped = normal + ridge[..., None] * np.eye(3)
        shift = np.linalg.solve(damped, (pull + ridge * own)[..., None])[..., 0]
        off = _across(shift[..., None, :], beam)[..., None, :, :] - gap
        distance = np.linalg.norm(off, axis=-1).mean(axis=-2)
        weight = weights(distance)
    turned = Rotation.from_matrix((turn @ nominal[:3, :3].T).reshape(-1, 3, 3)).magnitude()
    return distance, np.linalg.norm(shift - own, axis=-1) + LEVER_M * turned.reshape(turn.shape[:-2])


def _across(vector: Floats, beam: Floats) -> Floats:
    """(..., pose, 3) part of vectors, broadcast, across unit beams (..., pose, 3)."""
    return vector - np.einsum("...i,...i->...", vector, beam)[..., None] * beam


def fixture_of(rig: Rig) -> Fixture:
    """Both faces and where they are assumed to have stood. DataError where the rig has no fixture."""
    if rig.fixture is None or not rig.placements:
        raise DataError(f"rig {rig.name}: no [fixture] with a [[placement]]; dual-PSD data need both")
    pair = rig.fixture.psd2_in_psd1
    places = {k: transform(p.psd1_in_base.origin_m, p.psd1_in_base.rotation_rad) for k, p in rig.placements.items()}
    return Fixture(rig.fixture.half_size_m, transform(pair.origin_m, pair.rotation_rad), places)


def laser_of(rig: Rig) -> LaserMount:
    """The nominal laser. DataError where the rig has none."""
    if rig.tool.laser_origin_m is None or rig.tool.laser_direction is None:
        raise DataError(f"rig {rig.name}: tool.laser_origin_m and tool.laser_direction are needed for dual-PSD data")
    return LaserMount.from_drawing(np.array(rig.tool.laser_origin_m), np.array(rig.tool.laser_direction))


def dual_psd_of(rig: Rig, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> DualPsd:
    """The instrument alone; gains and PSD 2 in PSD 1 free under the [tolerance] that leaves them open."""
    gain = None if rig.tolerance is None else rig.tolerance.gain
    return DualPsd(laser_of(rig), fixture_of(rig), placement, first_psd, gain, pair_of(rig))


def psd_sigma_m(rig: Rig) -> float:
    """One sigma of a coordinate of a spot, as stated or else as usual."""
    return rig.noise.psd_m or PSD_ASSUMED_M


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(*SPOTS)
    if len(rows) == 0:
        return None
    seen = observations(table.samples, table.angles)
    sensor = dual_psd_of(table.rig, seen.placement, seen.first_psd)
    sigma = np.full((len(rows), 4), psd_sigma_m(table.rig)) if seen.sigma_m is None else seen.sigma_m
    return table.measured(KIND.name, SensorChain(table.arm, sensor), rows, seen.spots_m, {KIND.noise[0].name: sigma})


def _known_distances(table: SampleTable) -> tuple[Block, ...]:
    """Between placements that were both used; between others they show nothing."""
    if len(table.filled(*SPOTS)) == 0:
        return ()
    seen = observations(table.samples, table.angles)
    sensor = dual_psd_of(table.rig, seen.placement, seen.first_psd)
    frames = {k: sensor.fixture.T_base_psd1[k] for k in sensor.places}
    places = tuple(p for p in sensor.parameters if p.name.startswith("placement"))
    centres, axes = {k: T[:3, 3] for k, T in frames.items()}, {k: T[:3, :3] for k, T in frames.items()}
    used = set(seen.placement.tolist())
    return distances_between("placement", table.rig, used, places, centres, axes)


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows = filled(samples, *SPOTS, *PLACED)
    place = samples.integers(PLACED[0], 0)
    many = [k for k in np.unique(place[rows]) if np.sum(place[rows] == k) >= FEWEST_POSES]
    rows = thinned(rows[np.isin(place[rows], many)])
    if len(rows) == 0:
        return None
    mount, fixture = laser_of(rig), fixture_of(rig)
    return SpotsWitness(
        q_rad[rows],
        stacked(samples, SPOTS)[rows],
        place[rows],
        samples.integers(PLACED[1], 0)[rows],
        fixture.T_psd1_psd2,
        fixture.T_base_psd1,
        mount.origin_m,
        mount.direction,
    )


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    placement, first_psd = (samples.integers(name, 0) for name in PLACED)
    known = np.flatnonzero((placement > 0) & (first_psd > 0))
    sensor = dual_psd_of(found.rig, placement[known], first_psd[known])
    spots = np.full((len(samples), 4), np.nan)
    spots[known] = sensor.expect(found.values_of(sensor.parameters), T_base_flange[known])
    return dict(zip(SPOTS, spots.T, strict=True))


def _used(found: Found, samples: Samples, rows: NDArray[np.intp]) -> tuple[DualPsd, Floats]:
    placement, first_psd = (samples.integers(name, 0)[rows] for name in PLACED)
    sensor = dual_psd_of(found.rig, placement, first_psd)
    return sensor, found.values_of(sensor.parameters)


def _half_face_m(rig: Rig) -> float:
    """A spot that should lie beyond the face it was read on is none that a bump moved."""
    return np.inf if rig.fixture is None else rig.fixture.half_size_m


KIND = SensorKind(
    name="dual-psd",
    columns=SPOTS,
    title="Spots on the dual PSD",
    noun="spots",
    noise=(NoiseSource("psd", "m", "psd_m"),),
    traits=frozenset({Trait.LIGHT}),
    reads=SPOTS,
    asks=SPOTS,
    build=_build,
    lengths=_known_distances,
    witness=_witness,
    far_m=_half_face_m,
    predict=_predict,
    used=_used,
    place=lambda samples: samples.integers(PLACED[0], 0),
)
