"""Writes a session into one file that is whole at any instant: open, streams, samples, events, close.

Everyone who records only leaves items in a bounded spool; one thread owns the file (write_thread), writes what waits
every FLUSH_S and ends with `close`. A lock around the file would be simpler, but then a reader thread waits while the
disk syncs, and its serial line overruns. What a killed process loses is what waited: FLUSH_S of data and the batch that
was being written.

A reader thread holds a `StreamWriter`, which takes its device's samples, notices what is missing, and never waits for
the disk.
"""

import logging
import math
import platform
import threading
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.layout import (
    EVENT,
    EVENTS_TOPIC,
    FORMAT_VERSION,
    GAP,
    GAPS_TOPIC,
    NOTES_METADATA,
    RECORDING_METADATA,
    RIG_METADATA,
    STREAM_METADATA,
    MessageType,
    log_ns,
    packed,
)
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.mcap.write_thread import (
    Entry,
    Piece,
    SamplesEncoder,
    Scribe,
    Spool,
    StreamEncoder,
    declaration,
)
from acquisition.recording.recording import Channel, Event, Gap, Stamps, check_declaration
from acquisition.recording.rig import parse_rig, rig_sha256
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import Cell, Floats

ANSWER_S = 30.0  # a disk that takes longer than this for what waits is reported, not waited for
LONGEST = 160  # characters of an event's detail in the log; the recording has it all
LOUD = ("device failed", "device lost", "ended early", "skipped")  # kinds of event that are warnings in the log
log = logging.getLogger(__name__)
log.addHandler(logging.NullHandler())  # a program without a log of its own prints none of these
LARGEST = np.iinfo(np.int64).max


class Clock(Protocol):
    """Monotonic host time in seconds."""

    def now_s(self) -> float: ...


class StreamWriter:
    """Made by `RecordingWriter.stream`. May be used by several threads; samples keep the order of the calls."""

    def __init__(
        self,
        name: str,
        channels: tuple[Channel, ...],
        put: Callable[[Piece], None],
        put_gap: Callable[[Gap], None],
        after: tuple[int, float] | None = None,
        *,
        find_gaps: bool = True,
    ) -> None:
        self.name, self.channels = name, channels
        self._put, self._put_gap, self._find_gaps = put, put_gap, find_gaps
        self._turn = threading.Lock()
        self._kinds: dict[str, str] = {}  # channel -> "i" or "f", from the first block
        self._last = after  # sequence and host time of the last sample
        self.gaps = self.missing = 0  # gaps recorded so far; the samples that they state as missing

    @property
    def last(self) -> tuple[int, float] | None:
        """Sequence and host time of the last sample; None before the first."""
        return self._last

    def append(
        self, host_s: ArrayLike, device_s: ArrayLike, sequence: ArrayLike, values: Mapping[str, ArrayLike]
    ) -> None:
        """Samples in the order measured: clocks and sequence (sample,), every channel (sample, *shape), SI; copied.

        A jump of the sequence, also from the last call, is recorded as a gap. ValueError for shapes that do not fit
        what was declared. RecordingError when the recording failed or is closed; then the block is not kept, and if the
        next one is, the sequence shows it.
        """
        piece = Piece(
            np.array(host_s, dtype=np.float64, ndmin=1),
            np.array(device_s, dtype=np.float64, ndmin=1),
            np.array(sequence, dtype=np.int64, ndmin=1),
            {channel.name: self._values(channel, values) for channel in self.channels},
        )
        self._check(piece, values)
        if piece.host_s.size == 0:
            return
        with self._turn:
            self._check_kinds(piece)
            gaps = self._gaps(piece) if self._find_gaps else []
            self._put(piece)
            self._last = int(piece.sequence[-1]), float(piece.host_s[-1])
            for gap in gaps:
                self.gap(gap)

    def gap(self, gap: Gap) -> None:
        """Record that samples are missing, where the caller knows more than the sequence shows: a lost cable."""
        self.gaps += 1
        self.missing += max(gap.missing, 0)
        self._put_gap(gap)

    def _values(self, channel: Channel, values: Mapping[str, ArrayLike]) -> NDArray[Any]:
        if channel.name not in values:
            raise ValueError(f"stream '{self.name}': channel '{channel.name}' was declared but is not in the block")
        array = np.asarray(values[channel.name])
        if array.dtype == np.uint64 and array.size and array.max() > LARGEST:
            raise ValueError(
                f"stream '{self.name}': channel '{channel.name}' holds {array.max()}, beyond 64 bits with sign"
            )
        if array.dtype.kind not in "iubf":
            raise ValueError(f"stream '{self.name}': channel '{channel.name}' holds {array.dtype}, not numbers")
        return np.array(array, dtype=np.float64 if array.dtype.kind == "f" else np.int64, ndmin=1)

    def _check(self, piece: Piece, values: Mapping[str, ArrayLike]) -> None:
        if len(values) > len(self.channels):  # those that are declared are all there
            surplus = set(values) - {channel.name for channel in self.channels}
            raise ValueError(f"stream '{self.name}': channel '{min(surplus)}' was not declared; declare it first")
        for name, shape in (("device_s", piece.device_s.shape), ("sequence", piece.sequence.shape)):
            if shape != piece.host_s.shape:
                raise ValueError(f"stream '{self.name}': {name} has shape {shape}, host_s {piece.host_s.shape}")
        for channel in self.channels:
            shape, expected = piece.values[channel.name].shape, (piece.host_s.size, *channel.shape)
            if shape != expected:
                raise ValueError(
                    f"stream '{self.name}': channel '{channel.name}' has shape {shape}, expected {expected}"
                )
        if not np.isfinite(piece.host_s).all():
            raise ValueError(f"stream '{self.name}': host_s is not finite; it must come from the host clock")

    def _check_kinds(self, piece: Piece) -> None:
        for name, array in piece.values.items():
            kind = self._kinds.setdefault(name, array.dtype.kind)
            if kind != array.dtype.kind:
                raise ValueError(
                    f"stream '{self.name}': channel '{name}' held whole numbers in one block, real ones in another"
                )

    def _gaps(self, piece: Piece) -> list[Gap]:
        sequence, host_s = piece.sequence, piece.host_s
        follows = self._last is None or 0 <= sequence[0] - self._last[0] <= 1
        steps = sequence[1:] - sequence[:-1]
        if follows and not ((steps > 1) | (steps < 0)).any():
            return []
        if self._last is not None:
            sequence = np.concatenate([[self._last[0]], sequence])
            host_s = np.concatenate([[self._last[1]], host_s])
        steps = np.diff(sequence)
        jumps: list[int] = np.flatnonzero((steps > 1) | (steps < 0)).tolist()
        return [_gap(host_s, sequence, at) for at in jumps]


def _gap(host_s: Floats, sequence: NDArray[np.int64], at: int) -> Gap:
    before, after = int(sequence[at]), int(sequence[at + 1])
    if after < before:
        return Gap(
            float(host_s[at]), float(host_s[at + 1]), -1, f"the sequence went back from {before} to {after}: restarted"
        )
    return Gap(
        float(host_s[at]), float(host_s[at + 1]), after - before - 1, f"the sequence jumped from {before} to {after}"
    )


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
        log.info("recording begun: %s, rig %s", self.path, self.rig.name)

    def stream(
        self,
        name: str,
        channels: tuple[Channel, ...],
        viewer: tuple[str, ...] | None = None,
        after: tuple[int, float] | None = None,
        *,
        find_gaps: bool = True,
        stamps: Stamps = "unknown",
    ) -> StreamWriter:
        """Declare a device's stream. `viewer` names the channels of the thinned 20 Hz view; None: all.

        `after`: sequence and host time of the last sample in the file before, where this one goes on with it.
        `find_gaps=False`: gaps are recorded as the caller states them, none is found from the sequence.
        `stamps`: what device_s is the time of.
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
            encoder = StreamEncoder(name, channels, names if viewer is None else viewer, stamps)
            about = declaration(channels, stamps)
            self._spool.put(partial(self._begin_stream, name=name, about=about, encoder=encoder), 0)
            self._streams.add(name)
            log.info("%s: recorded from now on: %s", name, ", ".join(names))
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
        level = logging.DEBUG if event.kind == "sample" else logging.WARNING if event.kind in LOUD else logging.INFO
        log.log(level, "%s %s", event.kind, detail if len(detail) <= LONGEST else f"{detail[:LONGEST]}...")
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
        how = "complete" if complete else "cut short"
        log.info("recording closed: %s, settled samples: %d, %s", self.path, self._n_samples, how)

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

    def _begin_stream(self, file: McapFile, *, name: str, about: Mapping[str, str], encoder: StreamEncoder) -> None:
        file.metadata(STREAM_METADATA + name, about)
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
