"""A session as it was measured: what reading gives, whether from one file or from a session folder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from acquisition.recording.rig.schema import Rig
from acquisition.recording.samples import Samples
from acquisition.recording.stream import Event, Stream


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
