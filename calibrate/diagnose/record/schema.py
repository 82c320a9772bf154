"""diagnosis.json, version 1: what stands in it. docs/formats.md explains every key."""

from typing import Literal

import msgspec

from acquisition.recording.examination import Examination, ExaminationRecord
from acquisition.recording.files.bounds import Count, Label, Many, Name, Number, Sentence, Statistic, Whole

SCHEMA = 1


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Every part of the file."""


class SizeRecord(Record, frozen=True):
    """A parameter; null where it is no finite number."""

    value: Number | None
    sigma: Number | None


class NameRecord(Record, frozen=True):
    """Place, driver, form and physics of a cause, in the words of docs/formats.md."""

    where: Label
    depends_on: Label
    shape: Label
    order: Whole | None
    physics: Label


class RivalRecord(NameRecord, frozen=True):
    """A cause that the data cannot separate from the finding; `margin`: BIC by which the finding is better."""

    confidence: Statistic
    margin: Statistic
    plausible: bool = True  # False: it fits better, but only with a size that no machine has


class CurveRecord(Record, frozen=True):
    """The residual without the finding, pulled back to its port, over the driver; null where nothing is felt."""

    driver: Label
    unit: Label  # of the port: rad or m
    values: Many[Number | None]
    residual: Many[Number | None]
    fitted: Many[Number | None]

    def __post_init__(self) -> None:
        if not len(self.values) == len(self.residual) == len(self.fitted):
            raise ValueError("values, residual and fitted of a curve are of different lengths")


class FindingRecord(NameRecord, frozen=True):
    """One cause with its size and its uncertainty."""

    parameters: dict[Name, SizeRecord]
    share: Statistic | None  # null where it was found in a stream: it removes nothing from the samples
    confidence: Statistic
    says: Sentence
    rivals: Many[RivalRecord]
    p: Statistic
    bic_gain: Statistic | None
    held_out_gain: Statistic | None
    explains: Sentence = ""
    plausible_to: Statistic | None = (
        None  # the largest that a machine of its kind shows, in the unit of the first parameter
    )
    curve: CurveRecord | None = None
    stream: Label | None = None  # where it was found, if not in the samples
    from_s: Statistic | None = None  # on the clock of that stream
    to_s: Statistic | None = None


class ClockRecord(Record, frozen=True):
    """A device's clock against the joints' one: joints = own + offset_s + drift (own - middle_s)."""

    stream: Label
    status: Label
    offset_s: Statistic | None
    offset_sigma_s: Statistic | None
    drift: Statistic | None
    drift_sigma: Statistic | None
    middle_s: Statistic


class StreamsRecord(Record, frozen=True):
    """What the streams show beside the findings: usual things with their size, and what they cannot show."""

    stands: Count
    clocks: Many[ClockRecord]
    usual: Many[FindingRecord]
    unseen: Many[Sentence]


TORQUE = "torque"  # the `stream` of findings in torques
TORQUES_IN_MOTION = Examination(
    "torques in motion",
    ("q", "tau"),
    "record torques (tau, motor_tau) or currents beside the angles of all joints in motion",
)


class JointTorqueRecord(Record, frozen=True):
    """Torques of one joint, Nm rms; what the model leaves on the end of the motion, which neither fit has seen."""

    joint: Count
    moments: Count
    torque_nm: Statistic
    noise_nm: Statistic
    unseen_before_nm: Statistic | None
    unseen_after_nm: Statistic | None


class TorquesRecord(Record, frozen=True):
    """What a motion shows beside the findings."""

    made: Sentence
    joints: Many[JointTorqueRecord]
    known: Label = ""  # the model or simulation beside which causes were sought; of none: the rig file


class UnexplainedRecord(Record, frozen=True):
    """Structure without a name."""

    where: Label
    depends_on: Label
    rms_m: Statistic | None
    share: Statistic
    p: Statistic
    says: Sentence


class SplitRecord(Record, frozen=True):
    """Error of one instrument on samples that neither fit has seen."""

    split: Label
    instrument: Label
    observations: Count
    wild: Count
    rms_before_m: Statistic | None
    rms_after_m: Statistic | None
    removed_low: Statistic | None
    removed_high: Statistic | None


class FloorRecord(Record, frozen=True):
    """What remains unexplainable of one instrument, and how that is known."""

    instrument: Label
    rms_m: Statistic | None
    source: Sentence


class NoiseRecord(Record, frozen=True):
    """What is left of one quantity of an instrument, beside the noise that the rig file states of it."""

    instrument: Label
    quantity: Label
    unit: Label  # of `stated` and `found`: m or rad
    stated: Statistic | None  # rms of one coordinate
    found: Statistic | None
    times: Statistic | None
    times_sigma: Statistic | None
    statement: Label
    says: Sentence
    supports: Many[Sentence] = ()  # that what is left is noise
    opposes: Many[Sentence] = ()


class LackOfFitRecord(Record, frozen=True):
    """Misfit that comes back with a repeated pose, over the scatter within repeats."""

    groups: Count
    ratio: Statistic
    p: Statistic
    significant: bool


class RejectedRecord(NameRecord, frozen=True):
    """The best candidate of a physics that was tested and is not there; `bic_gain` null: not to be seen."""

    bic_gain: Statistic | None
    why: Sentence


class SmallestRecord(NameRecord, frozen=True):
    """The smallest size of a cause that these poses could show; `parameter` with its unit."""

    parameter: Label
    value: Statistic


class NotRecorded(Record, frozen=True):
    """A driver that the record does not hold, and the physics that cannot be determined without it."""

    driver: Label
    column: Label
    physics: Label


class FreeSpaceRecord(Record, frozen=True):
    """Predicted error of the target over poses drawn between the angles of the session."""

    rms_before_m: Statistic
    rms_after_m: Statistic
    poses: Count


class GrossErrorRecord(Record, frozen=True):
    """A fault of the file: its rows, from 1, took no part, or next to none; without rows all of it is wrong."""

    kind: Label
    rows: Many[Count]
    column: Sentence
    says: Sentence


class KnownRecord(Record, frozen=True):
    """The model that a diagnosis asked beside: names of effects that entered, and that hold for its session only."""

    same_recording: bool
    effects: Many[Name]
    left_out: Many[Name]


class ChangedRecord(Record, frozen=True):
    """A value of the known model that is another now; `known` null where the model has no such number."""

    parameter: Name
    known: Number | None
    by: Number
    sigma: Statistic


class IncompleteRecord(Record, frozen=True):
    """A stage of the diagnosis that has no result."""

    stage: Label
    reason: Sentence


class RigRecord(Record, frozen=True):
    """Which rig the session was made with."""

    name: Label
    sha256: Label


class DiagnosisFile(Record, frozen=True):
    """Content of diagnosis.json."""

    schema: Literal[1]
    verdict: Label
    noise_floor_m: Statistic | None
    rms_before_m: Statistic | None
    rms_after_m: Statistic | None
    findings: Many[FindingRecord]
    unexplained: UnexplainedRecord | None
    next: Many[Sentence]
    kind: Literal["calibeam-diagnosis"] = "calibeam-diagnosis"
    software: Label = ""
    rig: RigRecord | None = None
    samples: Count = 0
    noise_floor_source: Sentence = ""
    noise_wanders: bool = False
    also_unexplained: Many[UnexplainedRecord] = ()
    splits: Many[SplitRecord] = ()
    floors: Many[FloorRecord] = ()
    free_space: FreeSpaceRecord | None = None
    lack_of_fit: LackOfFitRecord | None = None
    rejected: Many[RejectedRecord] = ()
    invisible: Many[NameRecord] = ()
    smallest: Many[SmallestRecord] = ()
    confusable: tuple[tuple[NameRecord, NameRecord, Statistic], ...] = ()
    not_recorded: Many[NotRecorded] = ()
    derived: Many[Sentence] = ()
    blunders: Many[GrossErrorRecord] = ()
    streams: StreamsRecord | None = None
    known: KnownRecord | None = None  # of a diagnosis beside a model
    changed: Many[ChangedRecord] = ()
    incomplete: Many[IncompleteRecord] = ()  # what could not be looked at, and why
    noise: Many[NoiseRecord] = ()
    torques: TorquesRecord | None = None  # of a recording in motion
    examinations: Many[ExaminationRecord] = ()  # how each of them ended; of earlier files none is known


def of_poses(file: DiagnosisFile) -> tuple[FindingRecord, ...]:
    """The findings that a verdict on settled poses counts: what a drive takes is none. All of a recording without."""
    return tuple(one for one in file.findings if one.stream != TORQUE) if file.samples else file.findings


def no_better_with_physics(file: DiagnosisFile) -> str:
    """Why a model with the physics does not replace one of geometry alone; empty where it does.

    It has to be better on unseen rows for certain, by one way to split at least, and worse for certain by none.
    """
    if not any(one.stream is None for one in file.findings):
        return "no cause was found beside the geometry"
    sure = [(one.removed_low, one.removed_high) for one in file.splits]
    known = [(low, high) for low, high in sure if low is not None and high is not None]
    if not known:
        return "there is no proof on unseen rows"
    if any(high < 0.0 for _, high in known):
        return "on unseen rows it is worse with the physics"
    return "" if any(low > 0.0 for low, _ in known) else "on unseen rows it is not better for certain with the physics"
