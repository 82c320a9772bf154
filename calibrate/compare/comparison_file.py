"""A difference as it is found, and the records of compare.json, version 1, as in docs/formats.md."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import msgspec
import numpy as np

from acquisition.recording.examination import ExaminationRecord
from calibrate.compare.link_differs import (
    JudgedLink,
)
from calibrate.compare.rig_keys import RigKey
from calibrate.diagnose.assess import Named
from calibrate.diagnose.record.schema import DiagnosisFile, SizeRecord
from calibrate.model.effects.term import Size, with_sigma
from calibrate.model.model_file import ModelFile


class Level(Enum):
    """Causes, then constants, in this order; words of docs/formats.md."""

    EFFECTS = "effects"
    UNEXPLAINED = "unexplained"
    STREAMS = "streams"
    JOINTS = "joints"
    RIG = "rig"
    JOINT_ZEROS = "joint-zeros"
    LINKS = "links"
    ENCODER_ZEROS = "encoder-zeros"
    FRAMES = "frames"


class Side(Enum):
    """Who has an effect or a property."""

    NEITHER = ""  # a number of both that differs
    MEASURED = "measured"
    SIMULATED = "simulated"
    BOTH = "both"


CAUSES = (Level.EFFECTS, Level.UNEXPLAINED, Level.STREAMS, Level.JOINTS)
TARGET = "tool-moved"


@dataclass(frozen=True)
class Mismatch:
    """One difference, measured less simulated. `decides`: False where it is set up again for every recording."""

    level: Level
    where: str
    physics: str
    sizes: Mapping[str, Size]
    says: str
    decides: bool = True
    side: Side = Side.NEITHER
    p: float | None = None
    alternatives: tuple[Named, ...] = ()
    names: tuple[str, ...] = ()  # parameters of model.json that differ by these sizes, in their order

    @property
    def order(self) -> tuple[int, bool]:
        """Place in the list: the target on the flange is the last of the frames."""
        return list(Level).index(self.level), self.physics == TARGET


def in_words(name: str, size: Size) -> str:
    """In the unit of the name: 2.0153 ± 0.0078 mrad."""
    unit = "rad" if name.endswith("_rad") else "m"
    steps = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"))
    scale, prefix = next((one for one in steps if abs(size.value) >= one[0]), steps[-1])
    return f"{with_sigma(size.value / scale, size.sigma / scale)} {prefix}{unit}"


class NameOfCause(msgspec.Struct, frozen=True):
    """An alternative explanation."""

    where: str
    physics: str


class DifferenceRecord(msgspec.Struct, frozen=True):
    """One difference, measured less simulated, the unit of each size in its name."""

    level: str
    where: str
    physics: str
    sizes: dict[str, SizeRecord]
    side: str
    decides: bool
    p: float | None
    says: str
    alternatives: tuple[NameOfCause, ...]
    simulated: dict[str, float]  # with the structure of the simulation: its own values of these parameters


class DroppedRecord(msgspec.Struct, frozen=True):
    """A constant that is no difference: left as in the simulation, to within these sizes, which widen the others'."""

    where: str
    physics: str
    sizes: dict[str, SizeRecord]  # by the names of model.json


class ReadingRecord(msgspec.Struct, frozen=True):
    """Measured less simulated of one instrument, rms of a coordinate: as they stand, and after all that was found."""

    instrument: str
    unit: str
    rows: int
    rms_coordinate_before: float
    rms_coordinate_after: float
    noise: float | None


class StreamRecord(msgspec.Struct, frozen=True):
    """One device's stream in both recordings."""

    stream: str
    unit: str
    status: str
    offset_s: float | None  # simulated clock less measured clock, at `middle_s` of the measured one
    offset_sigma_s: float | None
    drift: float | None
    drift_sigma: float | None
    middle_s: float
    samples: int
    level: tuple[float, ...] | None
    rms: float | None
    noise: float | None
    largest: float | None
    largest_s: float | None
    parts: bool | None
    later_than_joints_s: float | None
    later_than_joints_sigma_s: float | None


class ComparedJoint(msgspec.Struct, frozen=True):
    """Torque of one joint (Nm rms) over the moments at which it turns."""

    joint: int
    moments: int
    measured_nm: float
    simulated_nm: float
    difference_nm: float
    left_nm: float  # with all that was found, and masses fitted within their tolerance
    noise_nm: float


class ComparedTorques(msgspec.Struct, frozen=True):
    """A motion beside a description of its torques."""

    source: str
    made: str  # how speeds and accelerations were made
    joints: tuple[ComparedJoint, ...]


class ComparisonFile(msgspec.Struct, frozen=True):
    """Everything; `first_link` is None where nothing parts."""

    schema: int
    kind: str
    software: str
    measured: str
    simulated: str
    matched: int
    only_measured_t_s: tuple[float, ...]
    only_simulated_t_s: tuple[float, ...]
    verdict: str
    says: str
    rig: tuple[RigKey, ...]
    differences: tuple[DifferenceRecord, ...]
    dropped: tuple[DroppedRecord, ...]
    readings: tuple[ReadingRecord, ...]
    first_link: str | None
    links: tuple[JudgedLink, ...]
    streams: tuple[StreamRecord, ...]
    notes: tuple[str, ...]
    diagnosis: DiagnosisFile | None
    torques: ComparedTorques | None = None
    examinations: tuple[ExaminationRecord, ...] = ()


def size_records(sizes: Mapping[str, Size]) -> dict[str, SizeRecord]:
    """As they are written; null for what is no number."""
    return {name: SizeRecord(_number(size.value), _number(size.sigma)) for name, size in sizes.items()}


def difference_record(one: Mismatch, structure: ModelFile | None) -> DifferenceRecord:
    """As it is written; with the values of a simulation whose structure is known."""
    others = tuple(_cause(name) for name in one.alternatives)
    own = {} if structure is None else _own(one, structure)
    sizes, side = size_records(one.sizes), one.side.value
    return DifferenceRecord(
        one.level.value, one.where, one.physics, sizes, side, one.decides, one.p, one.says, others, own
    )


def _own(one: Mismatch, structure: ModelFile) -> dict[str, float]:
    """The simulation's own values, by the model that it is made of."""
    known = {name: structure.chain[name] for name in one.names if name in structure.chain}
    for effect in structure.effects:
        if (effect.where, effect.physics) == (one.where, one.physics):
            known |= {name: p.value for name, p in effect.parameters.items() if p.value is not None}
    return known


def _cause(name: Named) -> NameOfCause:
    return NameOfCause(name.where, name.physics)


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
