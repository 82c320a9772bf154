"""One recording of a fleet: what is kept of it, small enough for thousands."""

from enum import Enum
from typing import Annotated

import msgspec

from acquisition.recording.files.bounds import (
    Correction,
    Count,
    Few,
    Identity,
    Label,
    Name,
    PerJoint,
    Radians,
    Sentence,
    Statistic,
)

Nanoseconds = Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]  # as the disk counts


class Outcome(Enum):
    """How a recording ended."""

    IDENTIFIED = "identified"
    EMPTY = "empty"  # it holds no settled sample: a log of encoders, for one
    FAILED = "failed"  # by its content: it would fail again
    LOST = "lost"  # its process died or took too long: worth another try


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Every part of a row."""


class Zero(Record, frozen=True):
    """Zero of one joint: angle in the arm's table = reading + drawn + value. Value None where `status` says why."""

    joint: Identity  # from 1
    value_rad: Correction | None
    sigma_rad: Statistic | None
    status: Sentence  # "determined", or why not
    drawn_rad: Radians  # theta_offset_rad of the rig file, about which the value is a correction


class Cause(Record, frozen=True):
    """A finding of the diagnosis, in the words of docs/formats.md."""

    where: Label
    depends_on: Label
    shape: Label
    physics: Label
    confidence: Statistic
    share: Statistic | None
    says: Sentence


class Row(Record, frozen=True):
    """What a run over a fleet says of one recording; SI units. Fields after `error` are empty where it failed."""

    path: Sentence
    name: Sentence  # below the folder of the fleet
    sha256: Label
    size_bytes: Count
    modified_ns: Nanoseconds
    outcome: Outcome
    software: Label  # "" where --again was stopped before it came to this one
    diagnosed: bool = False
    error: Sentence = ""
    seconds: Statistic = 0.0
    robot: Label = ""
    robot_serial: Label = ""
    rig: Label = ""
    started_utc: Label = ""  # ISO 8601, or a date; "" where nobody knows
    complete: bool = True
    samples: Count = 0
    instruments: Few[Name] = ()
    fit_status: Sentence = ""
    zeros: PerJoint[Zero] = ()
    noise: dict[Name, Statistic] = msgspec.field(default_factory=dict[Name, Statistic])  # source -> as found, m or rad
    held_out_before_m: Statistic | None = None  # first instrument, rms on unseen rows: arm as drawn
    held_out_after_m: Statistic | None = None
    free_space_before_m: Statistic | None = None  # rms over the workspace: arm as drawn against the identified one
    free_space_after_m: Statistic | None = None  # predicted rms of the identified one
    trust: Label = ""  # "good", "care", "bad"
    says: Sentence = ""
    verdict: Label = ""  # of the diagnosis: "mismatch", "consistent", "undecidable"
    causes: Few[Cause] = ()

    @property
    def good(self) -> bool:
        """Whether it gave numbers."""
        return self.outcome is Outcome.IDENTIFIED
