"""Writes a session into one file that is whole at any instant: open, streams, samples, events, close.

Everyone who records only leaves items in a bounded spool; one thread owns the file, writes what waits every FLUSH_S and
ends with `close`. A lock around the file would be simpler, but then a reader thread waits while the disk syncs, and its
serial line overruns. What a killed process loses is what waited: FLUSH_S of data and the batch that was being written.
"""

import math
import platform
import threading
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import msgspec
import numpy as np

from acquisition.recording.errors import RecordingError
from acquisition.recording.layout import (
    EVENTS_TOPIC,
    FORMAT_VERSION,
    GAPS_TOPIC,
    NOTES_METADATA,
    RECORDING_METADATA,
    RIG_METADATA,
    STREAM_METADATA,
    log_ns,
)
from acquisition.recording.mcap.layout import EVENT, GAP, MessageType, packed
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.mcap.write_thread import Piece, StreamEncoder, channels_json
from acquisition.recording.rig import parse_rig, rig_sha256
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import Cell
from acquisition.recording.samples_encoder import SamplesEncoder
from acquisition.recording.scribe import Entry, Scribe
from acquisition.recording.spool import Spool
from acquisition.recording.stream import Channel, Event, Gap, check_declaration
from acquisition.recording.stream_writer import StreamWriter

ANSWER_S = 30.0  # a disk that takes longer than this for what waits is reported, not waited for


class Clock(Protocol):
    """Monotonic host time in seconds."""

    def now_s(self) -> float: ...


class RecordingWriter:
    """Owner of a recording while it grows. All methods may be called from any thread.

    `rig_text` is kept to the letter, `software` is name and version, `notes` holds what else must travel with the data
    (seeds, plan, operator). `host_s0` is the host time that `t_s` of the samples counts from; now, if not given.
    RigFileError for a bad rig, RecordingError if the file exists or cannot be made; then nothing is left behind.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        rig_text: str,
        software: str,
        clock: Clock,
        notes: Mapping[str, str] | None = None,
        host_s0: float | None = None,
        started_utc: datetime | None = None,
        host: str | None = None,
    ) -> None:
        self.path = Path(path)
        self.rig = parse_rig(rig_text, f"{path} (rig)")
        self.host_s0 = clock.now_s() if host_s0 is None else host_s0
        self._streams: set[str] = set()  # names only: a stream knows its writer, and a cycle would keep a closed one
        self._samples_encoder = SamplesEncoder()
        self._topics: dict[str, int] = {}  # belongs to the writing thread
        self._n_samples = 0
        self._turn = threading.Lock()
        file = McapFile(self.path, software)
        self._spool: Spool[Entry] = Spool(str(self.path))
        self._scribe = Scribe(file, self._spool, str(self.path), self.host_s0)
        started = datetime.now(UTC) if started_utc is None else started_utc
        self._open(
            file,
            rig_text,
            notes or {},
            {
                "format_version": FORMAT_VERSION,
                "software": software,
                "host": platform.node() if host is None else host,
                "host_s0": repr(self.host_s0),
                "started_utc": started.astimezone(UTC).isoformat(),
            },
        )

    def _open(self, file: McapFile, rig_text: str, notes: Mapping[str, str], about: Mapping[str, str]) -> None:
        """What a file must hold from its first byte on; on the disk before anything is measured."""
        file.metadata(RECORDING_METADATA, about)
        file.metadata(RIG_METADATA, {"text": rig_text, "sha256": rig_sha256(rig_text)})
        file.metadata(NOTES_METADATA, {str(key): str(value) for key, value in notes.items()})
        try:
            file.flush()
        except OSError as error:
            file.give_up()
            self.path.unlink(missing_ok=True)
            raise RecordingError(f"{self.path}: cannot begin the recording ({error.strerror}); free space") from error
        self._scribe.start()

    def stream(
        self,
        name: str,
        channels: tuple[Channel, ...],
        viewer: tuple[str, ...] | None = None,
        after: tuple[int, float] | None = None,
        *,
        find_gaps: bool = True,
    ) -> StreamWriter:
        """Declare a device's stream. `viewer` names the channels of the thinned 20 Hz view; None: all.

        `after`: sequence and host time of the last sample in the file before, where this one goes on with it.
        `find_gaps=False`: gaps are recorded as the caller states them, none is found from the sequence.
        ValueError for names that cannot stand in a file, stand twice, or are not declared.
        """
        channels = tuple(channels)
        check_declaration(name, channels)
        names = tuple(channel.name for channel in channels)
        for viewed in viewer or ():
            if viewed not in names:
                raise ValueError(f"stream '{name}': the viewer asks for '{viewed}', which is no channel of {names}")
        with self._turn:
            if name in self._streams:
                raise ValueError(f"stream '{name}' is declared twice; give each device its own name")
            encoder = StreamEncoder(name, channels, names if viewer is None else viewer)
            self._spool.put(partial(self._begin_stream, name=name, channels=channels, encoder=encoder), 0)
            self._streams.add(name)
            put = partial(self._put_piece, encoder)
            return StreamWriter(name, channels, put, partial(self._put_gap, name), after, find_gaps=find_gaps)

    def sample(self, row: Mapping[str, Cell], host_s: float | None = None) -> None:
        """One settled sample: column -> value, None (or NaN) where missing; names of the session-folder format.

        `host_s` is when it was taken, for viewers; without it `t_s` is counted from `host_s0`.

        SamplesError for a row that could not be read back; RecordingError when the recording failed or is closed.
        """
        with self._turn:
            place = f"{self.path} sample {self._n_samples + 1}"
            columns = {name: [_plain(cell)] for name, cell in row.items()}
            checked = next(checked_samples(columns, self.rig, lambda _: place).rows())
            time_ns = log_ns(self.host_s0 + float(checked["t_s"] or 0.0) if host_s is None else host_s)
            self._spool.put(partial(self._samples_encoder.write, row=checked, log_ns=time_ns), 16 * len(row))
            self._n_samples += 1

    def event(self, event: Event) -> None:
        """Something that happened. TypeError if its detail cannot be written as JSON."""
        detail = msgspec.json.encode(event.detail, enc_hook=_plain_json).decode()
        values = {"host_s": event.host_s, "kind": event.kind, "detail_json": detail}
        self._put_message(EVENTS_TOPIC, EVENT, event.host_s, values)

    def flush(self) -> None:
        """Wait until everything recorded so far is on the disk. RecordingError when it is not within ANSWER_S."""
        self._spool.settle(ANSWER_S)

    def close(self, complete: bool = True) -> None:
        """Write what waits, add the index, close; safe to call again. `complete=False`: the session was cut short.

        RecordingError if the last of it could not be written; what is on the disk stays readable.
        """
        self._scribe.end(complete, ANSWER_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            self.close(complete=kind is None)
        except RecordingError:
            if kind is None:  # else what ended the session is the news, not what followed from it
                raise

    # What the writing thread does with the items of the spool.

    def _begin_stream(
        self, file: McapFile, *, name: str, channels: tuple[Channel, ...], encoder: StreamEncoder
    ) -> None:
        file.metadata(STREAM_METADATA + name, {"channels": channels_json(channels)})
        self._scribe.encoders.append(encoder)

    def _write_message(self, file: McapFile, *, topic: str, kind: MessageType, host_s: float, data: bytes) -> None:
        if topic not in self._topics:
            self._topics[topic] = file.topic(topic, kind, {})
        file.write(self._topics[topic], log_ns(host_s), data)

    # What the measuring threads leave there.

    def _put_piece(self, encoder: StreamEncoder, piece: Piece) -> None:
        self._spool.put(lambda _: encoder.add(piece), piece.size_bytes)

    def _put_gap(self, stream: str, gap: Gap) -> None:
        values = {
            "stream": stream,
            "from_s": gap.from_s,
            "to_s": gap.to_s,
            "missing": gap.missing,
            "reason": gap.reason,
        }
        self._put_message(GAPS_TOPIC, GAP, gap.to_s, values)

    def _put_message(self, topic: str, kind: MessageType, host_s: float, values: dict[str, Any]) -> None:
        if not math.isfinite(host_s):
            raise ValueError(f"a record for '{topic}' has host_s = {host_s}; it must come from the host clock")
        data = packed(kind, values)
        self._spool.put(partial(self._write_message, topic=topic, kind=kind, host_s=host_s, data=data), len(data))


def _plain(cell: Any) -> Cell:
    return cell.item() if isinstance(cell, np.generic) else cell


def _plain_json(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"an event's detail holds {type(value).__name__}; use numbers, text, lists and mappings")
