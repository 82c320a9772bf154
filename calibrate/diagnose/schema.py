"""diagnosis.json, version 1: what stands in it. docs/formats.md explains every key."""

from typing import Literal

import msgspec

SCHEMA = 1


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Every part of the file."""


class SizeRecord(Record, frozen=True):
    """A parameter; null where it is no finite number."""

    value: float | None
    sigma: float | None


class NameRecord(Record, frozen=True):
    """Place, driver, form and physics of a cause, in the words of docs/formats.md."""

    where: str
    depends_on: str
    shape: str
    order: int | None
    physics: str


class RivalRecord(NameRecord, frozen=True):
    """A cause that the data cannot tell from the finding; `margin`: BIC by which the finding is better."""

    confidence: float
    margin: float
    plausible: bool = True  # False: it fits better, but only with a size that no machine has


class CurveRecord(Record, frozen=True):
    """The residual without the finding, pulled back to its port, over the driver; null where nothing is felt."""

    driver: str
    unit: str  # of the port: rad or m
    values: tuple[float | None, ...]
    residual: tuple[float | None, ...]
    fitted: tuple[float | None, ...]


class FindingRecord(NameRecord, frozen=True):
    """One cause with its size and its doubt."""

    parameters: dict[str, SizeRecord]
    share: float | None  # null where it was found in a stream: it removes nothing from the samples
    confidence: float
    says: str
    rivals: tuple[RivalRecord, ...]
    p: float
    bic_gain: float | None
    held_out_gain: float | None
    explains: str = ""
    plausible_to: float | None = (
        None  # the largest that a machine of its kind shows, in the unit of the first parameter
    )
    curve: CurveRecord | None = None
    stream: str | None = None  # where it was found, if not in the samples
    from_s: float | None = None  # on the clock of that stream
    to_s: float | None = None


class ClockRecord(Record, frozen=True):
    """A device's clock against the joints' one: joints = own + offset_s + drift (own - middle_s)."""

    stream: str
    status: str
    offset_s: float | None
    offset_sigma_s: float | None
    drift: float | None
    drift_sigma: float | None
    middle_s: float


class StreamsRecord(Record, frozen=True):
    """What the streams show beside the findings: usual things with their size, and what they cannot show."""

    stands: int
    clocks: tuple[ClockRecord, ...]
    usual: tuple[FindingRecord, ...]
    unseen: tuple[str, ...]


class UnexplainedRecord(Record, frozen=True):
    """Structure without a name."""

    where: str
    depends_on: str
    rms_m: float | None
    share: float
    p: float
    says: str


class SplitRecord(Record, frozen=True):
    """Error of one instrument on samples that neither fit has seen."""

    split: str
    instrument: str
    observations: int
    wild: int
    rms_before_m: float | None
    rms_after_m: float | None
    removed_low: float | None
    removed_high: float | None


class FloorRecord(Record, frozen=True):
    """What remains unexplainable of one instrument, and how that is known."""

    instrument: str
    rms_m: float | None
    source: str


class LackOfFitRecord(Record, frozen=True):
    """Misfit that comes back with a repeated pose, over the scatter within repeats."""

    groups: int
    ratio: float
    p: float
    significant: bool


class RejectedRecord(NameRecord, frozen=True):
    """The best candidate of a physics that was tested and is not there; `bic_gain` null: not to be seen."""

    bic_gain: float | None
    why: str


class SmallestRecord(NameRecord, frozen=True):
    """The smallest size of a cause that these poses would have shown; `parameter` with its unit."""

    parameter: str
    value: float


class NotRecorded(Record, frozen=True):
    """A driver that the record does not hold, and the physics that cannot be told without it."""

    driver: str
    column: str
    physics: str


class FreeSpaceRecord(Record, frozen=True):
    """Predicted error of the target over poses drawn between the angles of the session."""

    rms_before_m: float
    rms_after_m: float
    poses: int


class BlunderRecord(Record, frozen=True):
    """A fault of the file: its rows, from 1, took no part, or next to none; without rows all of it is wrong."""

    kind: str
    rows: tuple[int, ...]
    column: str
    says: str


class RigRecord(Record, frozen=True):
    """Which rig the session was made with."""

    name: str
    sha256: str


class DiagnosisFile(Record, frozen=True):
    """Content of diagnosis.json."""

    schema: Literal[1]
    verdict: str
    noise_floor_m: float | None
    rms_before_m: float | None
    rms_after_m: float | None
    findings: tuple[FindingRecord, ...]
    unexplained: UnexplainedRecord | None
    next: tuple[str, ...]
    kind: Literal["calibeam-diagnosis"] = "calibeam-diagnosis"
    software: str = ""
    rig: RigRecord | None = None
    samples: int = 0
    noise_floor_source: str = ""
    noise_wanders: bool = False
    also_unexplained: tuple[UnexplainedRecord, ...] = ()
    splits: tuple[SplitRecord, ...] = ()
    floors: tuple[FloorRecord, ...] = ()
    free_space: FreeSpaceRecord | None = None
    lack_of_fit: LackOfFitRecord | None = None
    rejected: tuple[RejectedRecord, ...] = ()
    invisible: tuple[NameRecord, ...] = ()
    smallest: tuple[SmallestRecord, ...] = ()
    confusable: tuple[tuple[NameRecord, NameRecord, float], ...] = ()
    not_recorded: tuple[NotRecorded, ...] = ()
    derived: tuple[str, ...] = ()
    blunders: tuple[BlunderRecord, ...] = ()
    streams: StreamsRecord | None = None
