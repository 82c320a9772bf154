"""A session as it was measured: declared channels, streams of samples, settled samples, events, and the rig.

Nothing of the drivers is imported, so that fits run without any port: `Channel` repeats the five fields of the driver's
record on purpose.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.rig import Rig
from acquisition.recording.samples import Floats, Samples

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_STREAM_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_RESERVED = ("host_s", "device_s", "sequence")
Stamps = Literal["sampled", "sent", "arrived", "hardware", "restored", "unknown"]
STAMPS: tuple[Stamps, ...] = get_args(Stamps)


def time_utc(text: str) -> datetime:
    """Of an ISO 8601 time; one without a zone is UTC. ValueError for what is no time."""
    time = datetime.fromisoformat(text)
    return time if time.tzinfo else time.replace(tzinfo=UTC)


@dataclass(frozen=True)
class Channel:
    """One declared quantity; the unit is also the suffix of the name."""

    name: str
    unit: str
    shape: tuple[int, ...] = ()
    full_scale: float = math.inf
    resolution: float = 0.0


def scalar_names(channel: Channel) -> tuple[str, ...]:
    """Names of a channel's elements in views and tables: "q_rad_1" ... row by row; a scalar keeps its own name."""
    if channel.shape == ():
        return (channel.name,)
    return tuple(f"{channel.name}_{number + 1}" for number in range(math.prod(channel.shape)))


@dataclass(frozen=True)
class Gap:
    """A stretch of host time in which samples of a stream are known to be missing, and why."""

    from_s: float
    to_s: float
    missing: int  # number of samples, -1 where it cannot be known
    reason: str


@dataclass(frozen=True)
class Stream:
    """All samples of one device."""

    name: str
    channels: tuple[Channel, ...]
    host_s: Floats  # (sample,)
    device_s: Floats  # (sample,)
    sequence: NDArray[np.int64]  # (sample,)
    values: Mapping[str, NDArray[Any]]  # channel name -> (sample, *shape), SI
    gaps: tuple[Gap, ...] = ()
    stamps: Stamps = "unknown"  # what device_s states, where it is a number: docs/formats.md


@dataclass(frozen=True)
class Event:
    """Something that happened: a servo step, a placement, a stop, an error; `detail` is JSON-like."""

    host_s: float
    kind: str
    detail: Mapping[str, Any]


def check_declaration(name: str, channels: tuple[Channel, ...]) -> None:
    """ValueError for names that cannot stand in the file or that stand twice."""
    if not _STREAM_NAME.fullmatch(name):
        raise ValueError(f"stream '{name}': a name is letters, digits, - and _, beginning with a letter")
    names = [*_RESERVED, *(channel.name for channel in channels)]
    for channel in channels:
        if not _NAME.fullmatch(channel.name):
            raise ValueError(f"stream '{name}': channel '{channel.name}' is not letters, digits and _")
        if names.count(channel.name) > 1:
            raise ValueError(f"stream '{name}': channel '{channel.name}' is declared twice, or is one of {_RESERVED}")
    scalars = ["host_s", *(scalar for channel in channels for scalar in scalar_names(channel))]
    folded = [scalar.replace("_", "").lower() for scalar in (*scalars, "device_s", "sequence")]
    for scalar in scalars:
        if folded.count(scalar.replace("_", "").lower()) > 1:
            raise ValueError(f"stream '{name}': '{scalar}' differs from another name only in case and _; rename it")


@dataclass(frozen=True, eq=False)
class Recording:
    """Never changed, only read. `RecordingWriter` makes one, `read` opens it."""

    path: Path
    rig_text: str  # to the letter
    rig: Rig
    samples: Samples
    complete: bool  # False: the session was cut short, or the file is damaged
    damage: tuple[str, ...] = ()  # what could not be read, and where
    software: str = ""  # name and version of what recorded it; "" for a session folder
    host: str = ""
    started_utc: str = ""  # ISO 8601
    host_s0: float = 0.0  # host time from which the samples' t_s counts
    notes: Mapping[str, str] = field(default_factory=dict[str, str])
    streams: Mapping[str, Stream] = field(default_factory=dict[str, Stream])
    events: tuple[Event, ...] = ()

    @property
    def started(self) -> datetime | None:
        """When it began, by its own statement. RecordingError where that is no time."""
        try:
            return time_utc(self.started_utc) if self.started_utc else None
        except ValueError as error:
            raise RecordingError(
                f"{self.path}: started_utc = '{shown(self.started_utc)}' is no time; "
                "write it as 2026-11-24T08:30:00+00:00"
            ) from error
