"""All sensors, one line each, and those of installed packages; the order is that of blocks and parameters in a fit."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate import plug_ins
from calibrate.model.checks.witness import Witness
from calibrate.model.sensors import (
    bar,
    camera,
    distance,
    encoder_difference,
    full_pose,
    plane,
    point_line,
    position,
    seat,
    spots,
    wire,
)
from calibrate.model.sensors.kind import NoiseSource, SensorKind, Trait
from calibrate.plug_ins import loaded

Floats = NDArray[np.float64]

SENSORS: tuple[SensorKind, ...] = (
    spots.KIND,
    point_line.KIND,
    position.KIND,
    full_pose.KIND,
    distance.KIND,
    wire.KIND,
    seat.KIND,
    plane.KIND,
    bar.KIND,
    camera.KIND,
    encoder_difference.KIND,
    *loaded(plug_ins.SENSORS, SensorKind),
)
BY_NAME = {kind.name: kind for kind in SENSORS}
SOURCES: dict[str, NoiseSource] = {source.name: source for kind in SENSORS for source in kind.noise}
FRAMES = tuple(frame for kind in SENSORS for frame in kind.frames)
LENGTHS = tuple(name for name, source in SOURCES.items() if source.unit == "m")  # sources of noise that are lengths


def kind_of(name: str) -> SensorKind:
    """The sensor of this name. KeyError for a name that is none."""
    return BY_NAME[name]


def thousandth_of(name: str) -> str:
    """Unit in which a terminal shows the first quantity of a sensor: "mm" or "mrad"."""
    return f"m{kind_of(name).quantities[0].unit}"


def names_with(trait: Trait) -> tuple[str, ...]:
    """Names of all sensors that have it."""
    return tuple(kind.name for kind in SENSORS if trait in kind.traits)


def unused_columns(samples: Samples) -> tuple[str, ...]:
    """A sentence for each column that holds readings of a sensor and cannot be used as such."""
    return tuple(sentence for kind in SENSORS for sentence in kind.unused(samples))


def used_with(asked: Iterable[str]) -> tuple[SensorKind, ...]:
    """The sensors that readings are used by, where a plan asks for these names."""
    wanted = set(asked)
    given = [kind for kind in SENSORS if (kind.instead_of or kind.only_asked) and kind.name in wanted]
    displaced = {name for kind in given for name in kind.instead_of}
    return tuple(k for k in SENSORS if k in given or not (k.instead_of or k.only_asked or k.name in displaced))


def witnesses_of(rig: Rig, samples: Samples, q_rad: Floats) -> tuple[Witness, ...]:
    """All that the columns allow, at `q_rad` (row, joint). DataError where spots have no fixture or laser."""
    found = (kind.witness(rig, samples, q_rad) for kind in SENSORS)
    return tuple(witness for witness in found if witness is not None)
