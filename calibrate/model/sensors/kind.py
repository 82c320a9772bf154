"""What one sensor states of itself, once: an entry of the catalogue (catalogue.py), written in the sensor's own file.

Everything that works on all sensors (fit, diagnosis, prediction, report) asks this record. No other file of the product
spells a sensor's name or tests for its class; tests/calibrate/model/sensors/test_catalogue.py holds that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # an entry only names them
    from acquisition.recording import Samples
    from acquisition.recording.rig import Rig
    from calibrate.model.chain import Sensor
    from calibrate.model.checks.gross_error import GrossError, Shots
    from calibrate.model.checks.witness import Witness
    from calibrate.model.parameters import Parameter
    from calibrate.model.problem import Block, Measured
    from calibrate.model.sample_table import SampleTable

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Rows = NDArray[np.intp]
Columns = dict[str, Floats]


class Trait(Enum):
    """What physics and figures may ask of a sensor without naming it."""

    LIGHT = "the laser's beam on the two faces of a fixture"
    TARGET = "observes a target on the flange"
    SEVERAL_TARGETS = "each reading may be of another target on the flange"
    DEVICE = "a measuring device beside the arm: its frame may drift, its readings may be out of scale"
    IN_SPACE = "its first three readings are the target's position in the device's frame"
    ANGLE_ENCODERS = "turns about an upright and a level axis, each with an encoder"
    DRUM = "one length, paid out by a drum"
    CONES = "a probe in a seat of unknown position"
    TOUCHED = "a hand presses the probe into place"
    SCALELESS = "an arm half as large would give the same readings"
    BETWEEN_ENCODERS = "two encoders of a joint, read against each other: it sees joints, not the flange"


class Found(Protocol):
    """What a model knows, as far as a prediction needs it (calibrate/model/predict.py)."""

    @property
    def rig(self) -> Rig: ...

    @property
    def values(self) -> Mapping[str, float]:
        """Parameter -> correction."""
        ...

    @property
    def about(self) -> Mapping[str, tuple[float, ...]]:
        """What the corrections of frames and points are about."""
        ...

    def values_of(self, parameters: tuple[Parameter, ...]) -> Floats:
        """(param,) corrections where the model has them, else the start."""
        ...

    def tip_at(self, T_base_flange: Floats) -> Floats:
        """(pose, 3) target or probe tip in the base."""
        ...

    def turn_of_target(self) -> Floats:
        """(3, 3) orientation of the target in the flange."""
        ...


@dataclass(frozen=True)
class Quantity:
    """Part of a reading that is reported by itself; `name` is "" where the reading is one quantity."""

    name: str
    unit: str  # "m" or "rad"
    first: int = 0
    end: int | None = None

    @property
    def part(self) -> slice:
        """Of a reading (row, k)."""
        return slice(self.first, self.end)


@dataclass(frozen=True)
class NoiseSource:
    """A source of noise that is estimated from the residuals."""

    name: str  # as in model.json
    unit: str  # "m" or "rad"
    key: str = ""  # of the rig's [noise], where it can be stated


@dataclass(frozen=True)
class Frame:
    """Something whose place is found with a fit, in words for a person."""

    prefix: str  # of the names of its parameters
    noun: str
    where: str  # "where the cones are"
    one: str = ""  # "where cone": of one of several, which are numbered
    numbers: int = 3  # of `about` in model.json: a point, or 6 with a rotation vector


LENGTH = (Quantity("", "m"),)


@dataclass(frozen=True, kw_only=True)
class SensorKind:
    """A sensor. `build` gives None where the samples hold nothing for it, and DataError where rig and samples disagree.

    `predict` gives columns (row,) at flange poses (row, 4, 4) of samples; NaN where a row lacks what it needs.
    """

    name: str  # in fit plans, model.json and diagnosis.json
    columns: tuple[str, ...]  # of samples.csv that hold its observations
    further: tuple[str, ...] = ()  # that make `columns` an observation of this sensor
    title: str  # of its residuals in a report
    noun: str  # of its readings in a sentence
    quantities: tuple[Quantity, ...] = LENGTH
    noise: tuple[NoiseSource, ...]
    traits: frozenset[Trait] = frozenset()
    frames: tuple[Frame, ...] = ()
    instead_of: tuple[str, ...] = ()  # the same readings used otherwise: only where a fit plan asks for it by name
    only_asked: bool = False  # it knows no geometry: used only where it is asked for by name
    reads: tuple[str, ...] = ()  # columns of its prediction, in the order of its readings
    asks: tuple[str, ...] = ()  # samples with one of these columns ask for the prediction
    build: Callable[[SampleTable], Measured | None]
    lengths: Callable[[SampleTable], tuple[Block, ...]] = lambda table: ()  # known beside the readings
    point_m: Callable[[SampleTable], Floats | None] = lambda table: None  # (3,) target in the flange, from nothing else
    witness: Callable[[Rig, Samples, Floats], Witness | None] = lambda rig, samples, q_rad: None
    blocks: Callable[[Shots], tuple[GrossError, ...]] = lambda shots: ()  # rows of another session
    far_m: Callable[[Rig], float] = lambda rig: np.inf  # a reading farther off was not moved there by a bump
    predict: Callable[[Found, Floats, Samples], Columns] | None = None
    observed: Callable[[Found, Samples], Columns | None] = lambda found, samples: None  # where no column of `reads` is
    used: Callable[[Found, Samples, Rows], tuple[Sensor, Floats]] | None = None  # at some rows, with its values
    place: Callable[[Samples], Ints] | None = None  # (row,) placement or seat of a row, 0: none
    unused: Callable[[Samples], tuple[str, ...]] = lambda samples: ()  # columns that cannot be used, with the remedy
