"""A recording of days as a folder of recordings: segment-0001.mcap, segment-0002.mcap, ..., each whole in itself.

A segment ends when it is large or old enough, and the next begins without a sample between them lost. A log that was
ended, killed or cut off from power goes on in a new segment: what is there is never touched.
"""

import re
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.layout import BEFORE_NOTE, SEGMENT_NOTE
from acquisition.recording.mcap.writer import Clock, RecordingWriter, StreamWriter
from acquisition.recording.recording import Channel, Event, Gap, Stamps

_NAME = re.compile(r"segment-(\d+)\.mcap")

Begin = Callable[[Path, Mapping[str, str]], RecordingWriter]  # file and notes


@dataclass(frozen=True)
class Rotation:
    """When a segment is full. Defaults: what loads in seconds, and what one is ready to lose to a bad sector."""

    size_bytes: int = 256 * 2**20
    age_s: float = 3600.0


def segments(folder: Path) -> list[Path]:
    """The segments of a folder, in order; RecordingError where the folder cannot be read."""
    try:
        found = [(int(match[1]), path) for path in folder.iterdir() if (match := _NAME.fullmatch(path.name))]
    except OSError as error:
        raise RecordingError(f"{folder}: cannot search for segments ({error.strerror}); check the path") from error
    return [path for _, path in sorted(found)]


@dataclass
class SegmentStream:
    """A stream that goes on from segment to segment; takes what `StreamWriter` takes, from any thread."""

    name: str
    channels: tuple[Channel, ...]
    viewer: tuple[str, ...] | None
    writer: StreamWriter
    turn: threading.Lock = field(repr=False)
    stamps: Stamps = "unknown"

    def append(
        self, host_s: ArrayLike, device_s: ArrayLike, sequence: ArrayLike, values: Mapping[str, ArrayLike]
    ) -> None:
        with self.turn:
            self.writer.append(host_s, device_s, sequence, values)

    def gap(self, gap: Gap) -> None:
        with self.turn:
            self.writer.gap(gap)


class SegmentedRecording:
    """Owner of the open segment. `begin` makes a writer; RecordingError when the folder or the file cannot be made.

    `rotate_if_due` and `close` belong to one thread; the old segment is closed there, while readers go on into the new.
    """

    def __init__(self, folder: Path, begin: Begin, clock: Clock, rotation: Rotation | None = None) -> None:
        self.folder = folder
        self._begin, self._clock, self._rotation = begin, clock, rotation or Rotation()
        self._turn = threading.Lock()
        self._streams: list[SegmentStream] = []
        self._made_folder = not folder.exists()
        self.writer = self._next(_made(folder))

    def stream(
        self,
        name: str,
        channels: tuple[Channel, ...],
        viewer: tuple[str, ...] | None = None,
        *,
        stamps: Stamps = "unknown",
    ) -> SegmentStream:
        """As `RecordingWriter.stream`."""
        with self._turn:
            writer = self.writer.stream(name, channels, viewer, stamps=stamps)
            stream = SegmentStream(name, channels, viewer, writer, self._turn, stamps)
            self._streams.append(stream)
            return stream

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        """Something that happened, now."""
        with self._turn:
            self.writer.event(Event(self._clock.now_s(), kind, detail))

    def rotate_if_due(self) -> Path | None:
        """Go on in a new segment when this one is full; the one that was closed. RecordingError when the disk refuses.

        When the new one cannot be begun, nothing has happened: the old one goes on.
        """
        age_s = self._clock.now_s() - self._since_s
        if self.writer.path.stat().st_size < self._rotation.size_bytes and age_s < self._rotation.age_s:
            return None
        fresh = self._next(self.writer.path)
        with self._turn:
            full, self.writer = self.writer, fresh
            for stream in self._streams:
                before = stream.writer
                stream.writer = fresh.stream(
                    stream.name, stream.channels, stream.viewer, after=before.last, stamps=stream.stamps
                )
                stream.writer.gaps, stream.writer.missing = before.gaps, before.missing  # of the whole run
        full.close()
        return full.path

    def close(self, complete: bool = True) -> None:
        """As `RecordingWriter.close`."""
        self.writer.close(complete)

    def discard(self) -> None:
        """As if it had never been begun: the open segment goes, and the folder if it was made for it."""
        with suppress(RecordingError):  # why it could not be ended no longer matters
            self.writer.close(complete=False)
        self.writer.path.unlink(missing_ok=True)
        if self._made_folder:
            with suppress(OSError):  # something else is in it by now
                self.folder.rmdir()

    def _next(self, before: Path | None) -> RecordingWriter:
        there = segments(self.folder)
        number = 1 + max((_number(path) for path in there), default=0)
        notes = {SEGMENT_NOTE: str(number)} | ({} if before is None else {BEFORE_NOTE: before.name})
        writer = self._begin(self.folder / f"segment-{number:04d}.mcap", notes)
        self._since_s = self._clock.now_s()
        return writer


def _made(folder: Path) -> Path | None:
    """The folder made; its last segment, after which this log goes on."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder}: cannot make the folder ({error.strerror}); choose another place") from error
    there = segments(folder)
    return there[-1] if there else None


def _number(path: Path) -> int:
    match = _NAME.fullmatch(path.name)
    return int(match[1]) if match else 0
