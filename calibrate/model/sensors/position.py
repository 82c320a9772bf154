"""Instrument: a tracker or the like that measures the target's position (m) in its own frame."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, TARGET
from calibrate.errors import DataError
from calibrate.model.chain import About, SensorChain, Usage
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.checks.rough_fit import rough_fit_of_targets, rows_of_another_session
from calibrate.model.checks.witness import (
    ENOUGH_POSES,
    Otherwise,
    Strain,
    Witness,
    by_target,
    filled,
    stacked,
    thinned,
)
from calibrate.model.parameters import Parameter
from calibrate.model.placement import (
    TARGETS,
    Device,
    SeveralTargets,
    Target,
    point_by_twist,
    targets_of,
)
from calibrate.model.problem import Measured
from calibrate.model.rigid import transform
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    Frame,
    NoiseSource,
    SensorKind,
    Trait,
)

Floats = NDArray[np.float64]

POSITION_ASSUMED_M = 20e-6  # start value where the rig's [noise] states nothing; the data correct it
NOISE = NoiseSource("position", "m", "position_m")


@dataclass(frozen=True)
class Position(Usage):
    """Observed at a pose: x, y, z of the target in the device's frame. Parameters: 3 of each target, device 6."""

    target: Target | SeveralTargets
    device: Device

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.device.parameters

    def about(self) -> About:
        return {**self.target.about(), **self.device.about()}

    def placed(self, about: About) -> Self:
        return replace(self, target=self.target.placed(about), device=self.device.placed(about))

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, target=self.target.select(rows))

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        own, device = self._split(phi)
        T = self.device.T_base_device_at(device)
        return (self.target.in_base(own, T_base_flange) - T[:3, 3]) @ T[:3, :3]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        own, device = self._split(phi)
        R_device_base = self.device.T_base_device_at(device)[:3, :3].T
        return R_device_base @ point_by_twist(self.target.in_base(own, T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        own, device = self._split(phi)
        R_device_base = self.device.T_base_device_at(device)[:3, :3].T
        by_device = self.device.seen_by_parameter(device, self.target.in_base(own, T_base_flange))
        by_target = self.target.by_correction(R_device_base @ T_base_flange[:, :3, :3])
        return np.concatenate([by_target, by_device], axis=-1)

    def _split(self, phi: Floats) -> tuple[Floats, Floats]:
        """Values of the targets and of the device."""
        n = len(self.target.parameters)
        return phi[:n], phi[n:]


SAID_COLUMNS = "columns x_m, y_m, z_m"
FEWEST_POSES = 12  # a frame and a target have nine unknowns
FEWEST_OF_ONE = 4  # readings of one of several targets: fewer fit a point of their own whatever the arm does
MILLIMETRES = 1e-3


@dataclass(frozen=True)
class PositionWitness:
    """Frame and target are found; a drawn target should not have to move."""

    q_rad: Floats  # (pose, joint)
    position_m: Floats  # (pose, 3)
    point_m: Floats | None  # (3,) target at its nominal place in the flange frame; (target, 3) of several, NaN: unknown
    mirrored: bool = False
    columns: str = SAID_COLUMNS
    target: NDArray[np.intp] | None = None  # (pose,) which of several, from 0

    def strain(self, T_base_flange: Floats) -> Strain:
        drawn = np.full((1, 3), np.nan) if self.point_m is None else np.atleast_2d(self.point_m)
        target = np.zeros(len(self.q_rad), dtype=np.intp) if self.target is None else self.target
        start = np.nan_to_num(drawn)
        found = rough_fit_of_targets(T_base_flange, self.position_m, start, target, mirrored=self.mirrored)
        moved = np.nan_to_num(np.linalg.norm(found.point_m - drawn, axis=-1))
        return Strain(found.typical_m, np.mean(moved, axis=-1))

    def otherwise(self) -> Iterator[Otherwise]:
        """As `written_otherwise`."""
        for otherwise, _ in self.written_otherwise():
            yield otherwise

    def written_otherwise(self) -> Iterator[tuple[Otherwise, "PositionWitness"]]:
        """Columns that mirror the readings (one sign, or two of them exchanged; which is open), and millimetres.

        No instrument is left-handed: conventions.py searches for joint signs first.
        """
        other = replace(self, mirrored=not self.mirrored)
        yield (
            Otherwise(
                GrossErrorKind.MIRRORED_AXIS,
                self.columns,
                "only the mirror image of the readings fits the arm (determinant -1), and no instrument is left-handed",
                "change the sign of one of these columns, or exchange two, as the device's export shows",
                other,
            ),
            other,
        )
        other = replace(self, position_m=MILLIMETRES * self.position_m)
        yield (
            Otherwise(
                GrossErrorKind.MILLIMETRES,
                self.columns,
                "positions in millimetres",
                "write metres (millimetres times 0.001)",
                other,
            ),
            other,
        )


def position_sigma_m(rig: Rig) -> float:
    """One sigma of a coordinate, as stated or else as usual."""
    return rig.noise.position_m or POSITION_ASSUMED_M


def device_of(found: Found) -> Floats:
    """(4, 4) the measuring device in the base. DataError where neither model nor rig knows its place."""
    given = found.rig.device
    drawn = None if given is None else (*given.origin_m, *given.rotation_rad)
    place = found.about.get("device", drawn)
    if place is None:
        raise DataError(f"rig {found.rig.name}: no [device] and none in the model; fit positions or a wire first")
    device = Device(transform(place[:3], place[3:]))
    return device.T_base_device_at(found.values_of(device.parameters))


def predicted_positions(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    """The target in the device's frame."""
    T = device_of(found)
    return dict(zip(POSITION, ((seen_at(found, T_base_flange, samples) - T[:3, 3]) @ T[:3, :3]).T, strict=True))


def seen_at(found: Found, T_base_flange: Floats, samples: Samples) -> Floats:
    """(row, 3) the target of each row in the base: NaN in a row that names none where others do."""
    named = samples.integers(TARGET, 0)
    if not found.rig.targets or not named.any():
        return found.tip_at(T_base_flange)
    out = np.full((len(named), 3), np.nan)
    rows = np.flatnonzero(named)
    several = targets_of(found.rig, named[rows]).placed(found.about)
    out[rows] = several.in_base(found.values_of(several.parameters), T_base_flange[rows])
    return out


def _build(table: SampleTable) -> Measured | None:
    rows = np.setdiff1d(table.filled(*POSITION), table.filled(*POSITION, *ORIENTATION))
    if len(rows) == 0:
        return None
    own = {NOISE.name: np.full((len(rows), 3), position_sigma_m(table.rig))}
    chain = SensorChain(table.arm, Position(table.targets(rows) or table.target, table.device()))
    return table.measured(KIND.name, chain, rows, table.position_m[rows], own)


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    """Of all targets together, each at a point of its own; one that was hardly read fits anywhere, and is left out."""
    each = by_target(rig, samples, filled(samples, *POSITION))
    each = tuple(one for one in each if len(one[0]) >= FEWEST_OF_ONE)
    share = sum(len(rows) for rows, _ in each)
    if share < FEWEST_POSES:
        return None
    some = [thinned(rows, max(FEWEST_OF_ONE, round(ENOUGH_POSES * len(rows) / share))) for rows, _ in each]
    points_m = np.array([np.full(3, np.nan) if point_m is None else point_m for _, point_m in each])
    rows, target = np.concatenate(some), np.repeat(np.arange(len(some)), [len(one) for one in some])
    return PositionWitness(q_rad[rows], stacked(samples, POSITION)[rows], points_m, target=target)


KIND = SensorKind(
    name="position",
    columns=POSITION,
    title="Measured positions",
    noun="positions",
    noise=(NOISE,),
    traits=frozenset({Trait.TARGET, Trait.SEVERAL_TARGETS, Trait.DEVICE, Trait.IN_SPACE, Trait.ANGLE_ENCODERS}),
    frames=(Frame(TARGETS, "target", "where the targets sit on the flange", "where target"),),
    reads=POSITION,
    asks=POSITION,
    build=_build,
    point_m=lambda table: table.tool_seen_m,
    witness=_witness,
    blocks=rows_of_another_session,
    predict=predicted_positions,
)
