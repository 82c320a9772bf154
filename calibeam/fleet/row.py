"""A recording of a fleet as a task for a worker and as a row of the table.

Both are frozen and small enough for thousands of recordings.
"""

import signal
import sys
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
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
from calibeam.fleet.recordings import Found, content_sha256
from calibeam.software import SOFTWARE

Nanoseconds = Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]  # as the disk counts


class Outcome(Enum):
    """How a recording ended."""

    IDENTIFIED = "identified"
    EMPTY = "empty"  # it holds no settled sample: a log of encoders, for one
    FAILED = "failed"  # by its content: it would fail again
    LOST = "lost"  # its process died or took too long: worth another try


class FleetRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Every part of a row."""


class Zero(FleetRecord, frozen=True):
    """Zero of one joint: angle in the arm's table = reading + nominal + value. Value None where `status` gives the
    reason.
    """

    joint: Identity  # from 1
    value_rad: Correction | None
    sigma_rad: Statistic | None
    status: Sentence  # "determined", or why not
    drawn_rad: Radians  # theta_offset_rad of the rig file, about which the value is a correction


class Cause(FleetRecord, frozen=True):
    """A finding of the diagnosis, in the words of docs/formats.md."""

    where: Label
    depends_on: Label
    shape: Label
    physics: Label
    confidence: Statistic
    share: Statistic | None
    says: Sentence


class Row(FleetRecord, frozen=True):
    """What a run over a fleet reports of one recording; SI units. Fields after `error` are empty where it failed."""

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
    started_utc: Label = ""  # ISO 8601, or a date; "" where it is unknown
    complete: bool = True
    samples: Count = 0
    instruments: Few[Name] = ()
    fit_status: Sentence = ""
    zeros: PerJoint[Zero] = ()
    noise: dict[Name, Statistic] = msgspec.field(default_factory=dict[Name, Statistic])  # source -> as found, m or rad
    held_out_before_m: Statistic | None = None  # first instrument, rms on unseen rows: nominal arm
    held_out_after_m: Statistic | None = None
    free_space_before_m: Statistic | None = None  # rms over the workspace: nominal arm against the identified one
    free_space_after_m: Statistic | None = None  # predicted rms of the identified one
    trust: Label = ""  # "yes", "with care", "no"
    says: Sentence = ""
    verdict: Label = ""  # of the diagnosis: "mismatch", "consistent", "undecidable"
    causes: Few[Cause] = ()

    @property
    def good(self) -> bool:
        """Whether it gave numbers."""
        return self.outcome is Outcome.IDENTIFIED


CHILD = (sys.executable, "-P", "-m", "calibeam.fleet.worker")


class Task(msgspec.Struct, frozen=True):
    """One recording, as it goes to the process that reads it."""

    path: str
    name: str
    size_bytes: int
    modified_ns: int
    diagnose: bool
    date: str = ""  # stands for the recording's own start

    @classmethod
    def of(cls, found: Found, *, diagnose: bool) -> "Task":
        return cls(str(found.path), found.name, found.size_bytes, found.modified_ns, diagnose, found.date)

    def row(self, outcome: Outcome, **fields: object) -> Row:
        """A row of this recording."""
        known = {name: getattr(self, name) for name in ("path", "name", "size_bytes", "modified_ns")}
        return msgspec.convert(
            {"sha256": "", "software": SOFTWARE, "diagnosed": self.diagnose, **known, "outcome": outcome, **fields}, Row
        )

    def lost(self, why: str, seconds: float = 0.0) -> Row:
        """What stands in the table where no process brought it to an end."""
        sha256 = ""
        with suppress(OSError):
            sha256 = content_sha256(Path(self.path))
        return self.row(Outcome.LOST, sha256=sha256, error=why, seconds=seconds)


@dataclass(frozen=True)
class Order:
    """A task with its limits."""

    task: Task
    timeout_s: float | None
    command: tuple[str, ...] = CHILD


def death(returncode: int) -> str:
    """How a process ended, for a person."""
    if returncode >= 0:
        return f"its process ended by itself with code {returncode}"
    name = signal.Signals(-returncode).name if -returncode in set(signal.Signals) else str(-returncode)
    often = "; most often memory was short: give fewer --jobs" if -returncode == signal.SIGKILL else ""
    return f"its process was ended by {name}{often}"
