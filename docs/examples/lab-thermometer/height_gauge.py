"""A height gauge: how high the target stands above a surface plate, one number a pose in the column `height_m`."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from acquisition.recording import Samples
from calibrate.model.chain import About, SensorChain, Usage
from calibrate.model.parameters import Parameter
from calibrate.model.placement import Device, Target, point_by_twist
from calibrate.model.problem import Measured
from calibrate.model.rigid import transform
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    Columns,
    Floats,
    Found,
    Frame,
    NoiseSource,
    Rows,
    SensorKind,
    Trait,
)

COLUMN = "height_m"
SIGMA_M = 10e-6  # one sigma to start from; the data correct it
UP = slice(2, 3)  # of a position in the frame of the plate
LEVEL = slice(2, 5)  # of the six corrections of a frame: height and two tilts; a plane has no others


@dataclass(frozen=True)
class Height(Usage):
    """Parameters: target 3, then z, roll and pitch of the plate."""

    target: Target
    plate: Device

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.plate.parameters[LEVEL]

    def about(self) -> About:
        return {**self.target.about(), **self.plate.about()}

    def placed(self, about: About) -> Self:
        return replace(self, target=self.target.placed(about), plate=self.plate.placed(about))

    def select(self, rows: Rows) -> Self:
        return self

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        T = self.plate.T_base_device_at(_six(phi[3:]))
        return ((self.target.in_base(phi[:3], T_base_flange) - T[:3, 3]) @ T[:3, :3])[:, UP]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R = self.plate.T_base_device_at(_six(phi[3:]))[:3, :3]
        return (R.T @ point_by_twist(self.target.in_base(phi[:3], T_base_flange)))[:, UP]

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        six, point_m = _six(phi[3:]), self.target.in_base(phi[:3], T_base_flange)
        by_target = self.plate.T_base_device_at(six)[:3, :3].T @ T_base_flange[:, :3, :3]
        return np.concatenate([by_target[:, UP], self.plate.seen_by_parameter(six, point_m)[:, UP, LEVEL]], axis=-1)


def _six(level: Floats) -> Floats:
    out = np.zeros(6)
    out[LEVEL] = level
    return out


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(COLUMN)
    if len(rows) == 0:
        return None
    height_m = table.samples.column(COLUMN)[rows]
    T_base_plate = np.eye(4)
    T_base_plate[2, 3] = np.mean(table.tips_m[rows, 2] - height_m)
    chain = SensorChain(table.arm, Height(table.target, Device(T_base_plate, name="plate")))
    own = {"height": np.full((len(rows), 1), SIGMA_M)}
    return table.measured(KIND.name, chain, rows, height_m[:, None], own)


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    place = found.about["plate"]
    plate = Device(transform(place[:3], place[3:]), name="plate")
    T = plate.T_base_device_at(_six(found.values_of(plate.parameters[LEVEL])))
    return {COLUMN: ((found.tip_at(T_base_flange) - T[:3, 3]) @ T[:3, 2])}


KIND = SensorKind(
    name="height",
    columns=(COLUMN,),
    title="Heights above the plate",
    noun="heights",
    noise=(NoiseSource("height", "m"),),
    traits=frozenset({Trait.TARGET}),
    frames=(Frame("plate", "plate", "where the plate is", numbers=6),),
    reads=(COLUMN,),
    asks=(COLUMN,),
    build=_build,
    predict=_predict,
)
