"""Instrument: a draw wire (or a ball bar with its seat as origin) that measures the distance to the target."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import WIRE as COLUMN
from calibrate.errors import DataError
from calibrate.model.alignment import trilaterate
from calibrate.model.chain import About, SensorChain, Usage
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.checks.rough_fit import least_distance, median
from calibrate.model.checks.witness import (
    Otherwise,
    Strain,
    Witness,
    drawn_point_m,
    filled,
    thinned,
)
from calibrate.model.parameters import Parameter
from calibrate.model.placement import Device, Target, point_by_twist
from calibrate.model.problem import Measured
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    NoiseSource,
    SensorKind,
    Trait,
)
from calibrate.model.sensors.position import device_of

Floats = NDArray[np.float64]

WIRE_ASSUMED_M = 50e-6  # start value where the rig's [noise] states nothing; the data correct it


@dataclass(frozen=True)
class Wire(Usage):
    """Observed at a pose: distance (m) from the device's origin to the target. Parameters: target 3, origin 3.

    A length knows nothing of the device's axes, so only the origin of `device` counts.
    """

    target: Target
    device: Device

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.device.origin_parameters

    def about(self) -> About:
        return {**self.target.about(), **self.device.about()}

    def placed(self, about: About) -> Self:
        return replace(self, target=self.target.placed(about), device=self.device.placed(about))

    def select(self, rows: NDArray[np.intp]) -> Self:
        return self

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        span = self._span(phi, T_base_flange)
        return np.linalg.norm(span, axis=1, keepdims=True)

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        along = self._along(phi, T_base_flange)
        return along[:, None] @ point_by_twist(self.target.in_base(phi[:3], T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        along = self._along(phi, T_base_flange)[:, None]
        R_base_device = self.device.T_base_device[:3, :3]
        return np.concatenate([along @ T_base_flange[:, :3, :3], -along @ R_base_device], axis=-1)

    def _span(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return self.target.in_base(phi[:3], T_base_flange) - self.device.origin_m(phi[3:])

    def _along(self, phi: Floats, T_base_flange: Floats) -> Floats:
        span = self._span(phi, T_base_flange)
        return span / np.linalg.norm(span, axis=1, keepdims=True)


FEWEST_POSES = 30  # one number each; drum and target have six unknowns


@dataclass(frozen=True)
class WireWitness:
    """Drum and target are found, from trilateration and from the place in the rig; a drawn target should not move."""

    q_rad: Floats  # (pose, joint)
    length_m: Floats  # (pose,)
    point_m: Floats | None  # (3,) target at its nominal place in the flange frame
    drum_m: Floats | None  # (3,) as the rig states, in the base

    def strain(self, T_base_flange: Floats) -> Strain:
        R, t = T_base_flange[..., :3, :3], T_base_flange[..., :3, 3]
        drawn = np.zeros(3) if self.point_m is None else self.point_m

        def rows(x: Floats) -> tuple[Floats, Floats]:
            span = (R @ (drawn + x[..., :3])[..., None, :, None])[..., 0] + t - x[..., None, 3:]
            length = np.maximum(np.linalg.norm(span, axis=-1), 1e-9)
            along = span / length[..., None]
            return length - self.length_m, np.concatenate([(along[..., None, :] @ R)[..., 0, :], -along], axis=-1)

        drum = _trilaterated(R @ drawn + t, self.length_m)
        x, distance = least_distance(rows, np.concatenate([np.zeros_like(drum), drum], axis=-1))
        if self.drum_m is not None:
            drum = np.broadcast_to(self.drum_m, drum.shape)
            instead, left = least_distance(rows, np.concatenate([np.zeros_like(drum), drum], axis=-1))
            better = np.sum(left, axis=-1, keepdims=True) < np.sum(distance, axis=-1, keepdims=True)
            x, distance = np.where(better, instead, x), np.where(better, left, distance)
        moved = np.linalg.norm(x[..., :3], axis=-1)
        return Strain(median(distance), 0.0 * moved if self.point_m is None else moved)

    def otherwise(self) -> Iterator[Otherwise]:
        """Millimetres."""
        remedy = "write metres (millimetres times 0.001)"
        converted = replace(self, length_m=1e-3 * self.length_m)
        yield Otherwise(GrossErrorKind.MILLIMETRES, "column wire_m", "lengths in millimetres", remedy, converted)


def _trilaterated(points_m: Floats, lengths_m: Floats) -> Floats:
    """(..., 3) as model/alignment.py `trilaterate`, but an answer for every hypothesis, also of points in a plane."""
    middle = points_m.mean(axis=-2)
    p = points_m - middle[..., None, :]
    square = np.sum(p**2, axis=-1) - lengths_m**2
    square -= square.mean(axis=-1, keepdims=True)
    return np.asarray((np.linalg.pinv(2.0 * p, rcond=1e-6) @ square[..., None])[..., 0] + middle, dtype=np.float64)


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(COLUMN)
    if len(rows) == 0:
        return None
    length_m = table.samples.column(COLUMN)[rows]
    if np.any(length_m <= 0.0):
        bad = int(np.argmax(length_m <= 0.0))
        raise DataError(
            f"samples row {rows[bad] + 1}, column '{COLUMN}': {length_m[bad]} m; a length is positive: empty the cell"
        )
    sensor = Wire(table.target, table.device(lambda: trilaterate(table.tips_m[rows], length_m)))
    own = {KIND.noise[0].name: np.full((len(rows), 1), table.rig.noise.wire_m or WIRE_ASSUMED_M)}
    return table.measured(KIND.name, SensorChain(table.arm, sensor), rows, length_m[:, None], own)


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows = thinned(filled(samples, COLUMN))
    if len(rows) < FEWEST_POSES:
        return None
    drum = None if rig.device is None else np.array(rig.device.origin_m)
    return WireWitness(q_rad[rows], samples.column(COLUMN)[rows], drawn_point_m(rig), drum)


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    span = found.tip_at(T_base_flange) - device_of(found)[:3, 3]
    return {COLUMN: np.linalg.norm(span, axis=1)}


KIND = SensorKind(
    name="wire",
    columns=(COLUMN,),
    title="Wire lengths",
    noun="wire lengths",
    noise=(NoiseSource("wire", "m", "wire_m"),),
    traits=frozenset({Trait.TARGET, Trait.DEVICE, Trait.DRUM}),
    reads=(COLUMN,),
    asks=(COLUMN,),
    build=_build,
    witness=_witness,
    predict=_predict,
)
