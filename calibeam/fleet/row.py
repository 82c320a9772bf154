"""One recording of a fleet: what is kept of it, small enough for thousands."""

from enum import Enum

import msgspec


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

    joint: int  # from 1
    value_rad: float | None
    sigma_rad: float | None
    status: str  # "determined", or why not
    drawn_rad: float  # theta_offset_rad of the rig file, about which the value is a correction


class Cause(Record, frozen=True):
    """A finding of the diagnosis, in the words of docs/formats.md."""

    where: str
    depends_on: str
    shape: str
    physics: str
    confidence: float
    share: float | None
    says: str


class Row(Record, frozen=True):
    """What a run over a fleet says of one recording; SI units. Fields after `error` are empty where it failed."""

    path: str
    name: str  # below the folder of the fleet
    sha256: str
    size_bytes: int
    modified_ns: int
    outcome: Outcome
    software: str  # "" where --again was stopped before it came to this one
    diagnosed: bool = False
    error: str = ""
    seconds: float = 0.0
    robot: str = ""
    robot_serial: str = ""
    rig: str = ""
    started_utc: str = ""  # ISO 8601, or a date; "" where nobody knows
    complete: bool = True
    samples: int = 0
    instruments: tuple[str, ...] = ()
    fit_status: str = ""
    zeros: tuple[Zero, ...] = ()
    noise: dict[str, float] = msgspec.field(default_factory=dict[str, float])  # source -> as found, m or rad
    held_out_before_m: float | None = None  # first instrument, rms on unseen rows: arm as drawn
    held_out_after_m: float | None = None
    free_space_before_m: float | None = None  # rms over the workspace: arm as drawn against the identified one
    free_space_after_m: float | None = None  # predicted rms of the identified one
    trust: str = ""  # "good", "care", "bad"
    says: str = ""
    verdict: str = ""  # of the diagnosis: "mismatch", "consistent", "undecidable"
    causes: tuple[Cause, ...] = ()

    @property
    def good(self) -> bool:
        """Whether it gave numbers."""
        return self.outcome is Outcome.IDENTIFIED
