"""The one thread that owns the file: what it is left, how that becomes messages, how it is written.

`Spool` is the bounded queue between the threads that measure and this one. Whoever measures must not wait for a disk,
and a disk that falls behind must not go unnoticed: `put` never blocks, and raises when the limit is reached, when
writing has failed, and when the recording is closed. `Scribe` takes what waits, writes it and flushes; the first
failure of the disk ends it.

`StreamEncoder` makes batches that hold everything, and a thinned view that viewers can plot; the kind of number of a
channel, whole or real, is that of its first block, so topics are declared when the first block comes. `SamplesEncoder`
makes one message a settled sample, one field a column; absent means missing. A sample with a new column gets a new
message kind under the same topic that has all columns so far: nothing is declared in advance and nothing is dropped.
"""

import contextlib
import errno
import re
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.layout import (
    END_METADATA,
    SAMPLES_TOPIC,
    STREAM_TOPIC,
    VIEW_S,
    VIEW_TOPIC,
    Field,
    FieldType,
    MessageType,
    Presence,
    log_ns,
    message_type,
    packed,
    view_type,
)
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.recording import Channel, Stamps, scalar_names
from acquisition.recording.samples import Cell, Floats, Kind, kind_of

BATCH = 100  # samples a message: a tenth of the time and of the size of single ones, measured with this library

_CLOCKS = (("host_s", FieldType.DOUBLE), ("device_s", FieldType.DOUBLE), ("sequence", FieldType.INT64))


@dataclass(frozen=True)
class Piece:
    """Some consecutive samples of one stream; the arrays belong to whoever holds it."""

    host_s: Floats
    device_s: Floats
    sequence: NDArray[np.int64]
    values: Mapping[str, NDArray[Any]]  # channel name -> (sample, *shape), int64 or float64

    @property
    def size_bytes(self) -> int:
        return self.host_s.nbytes * 3 + sum(array.nbytes for array in self.values.values())


class StreamEncoder:
    """Owned by the writing thread: collects pieces between two flushes and writes them."""

    def __init__(self, name: str, channels: tuple[Channel, ...], viewed: tuple[str, ...], stamps: Stamps) -> None:
        self._name, self._channels = name, channels
        self._stamps: Stamps = stamps
        self._viewed = tuple(channel for channel in channels if channel.name in viewed)
        self._pieces: list[Piece] = []
        self._batch: tuple[int, MessageType] | None = None
        self._view: tuple[int, MessageType] | None = None
        self._next_view_s = -np.inf

    def add(self, piece: Piece) -> None:
        self._pieces.append(piece)

    def emit(self, file: McapFile) -> None:
        """Everything collected, as messages of up to BATCH samples, and the view of it."""
        if not self._pieces:
            return
        piece, self._pieces = _joined(self._pieces), []
        if self._batch is None:
            self._declare(file, piece)
        for start in range(0, piece.host_s.size, BATCH):
            self._emit_batch(file, piece, slice(start, start + BATCH))
        self._emit_view(file, piece)

    def _declare(self, file: McapFile, piece: Piece) -> None:
        fields = [Field(name, kind, Presence.REPEATED) for name, kind in _CLOCKS]
        for name, array in piece.values.items():
            fields.append(
                Field(name, FieldType.INT64 if array.dtype.kind == "i" else FieldType.DOUBLE, Presence.REPEATED)
            )
        identifier = self._name.replace("-", "_")
        batch = message_type(f"{identifier}_batch", tuple(fields))
        about = declaration(self._channels, self._stamps)
        self._batch = file.topic(STREAM_TOPIC + self._name, batch, about), batch
        if self._viewed:
            names = ("host_s", *(name for channel in self._viewed for name in scalar_names(channel)))
            view = view_type(self._name, names)
            self._view = file.topic(VIEW_TOPIC + self._name, view, {}), view

    def _emit_batch(self, file: McapFile, piece: Piece, rows: slice) -> None:
        assert self._batch is not None  # noqa: S101 - declared before anything is emitted
        topic, kind = self._batch
        values: dict[str, Any] = {
            "host_s": piece.host_s[rows].tolist(),
            "device_s": piece.device_s[rows].tolist(),
            "sequence": piece.sequence[rows].tolist(),
        }
        values |= {name: array[rows].reshape(-1).tolist() for name, array in piece.values.items()}
        host_s = values["host_s"]
        file.write(topic, log_ns(host_s[0]), packed(kind, values), until_ns=log_ns(host_s[-1]))

    def _emit_view(self, file: McapFile, piece: Piece) -> None:
        if self._view is None:
            return
        topic, kind = self._view
        for row, host_s in enumerate(piece.host_s.tolist()):
            if host_s >= self._next_view_s:
                self._next_view_s = host_s + VIEW_S
                values = {"host_s": host_s}
                for channel in self._viewed:
                    scalars = piece.values[channel.name][row].reshape(-1).tolist()
                    values |= dict(zip(scalar_names(channel), map(float, scalars), strict=True))
                file.write(topic, log_ns(host_s), packed(kind, values))


def declaration(channels: tuple[Channel, ...], stamps: Stamps) -> dict[str, str]:
    """A declared stream as it stands in the file; an infinite full scale is left out."""
    rows = [
        {"name": channel.name, "unit": channel.unit, "shape": list(channel.shape), "resolution": channel.resolution}
        | ({"full_scale": channel.full_scale} if np.isfinite(channel.full_scale) else {})
        for channel in channels
    ]
    return {"channels": msgspec.json.encode(rows).decode(), "stamps": stamps}


def _joined(pieces: list[Piece]) -> Piece:
    if len(pieces) == 1:
        return pieces[0]
    return Piece(
        np.concatenate([piece.host_s for piece in pieces]),
        np.concatenate([piece.device_s for piece in pieces]),
        np.concatenate([piece.sequence for piece in pieces]),
        {name: np.concatenate([piece.values[name] for piece in pieces]) for name in pieces[0].values},
    )


_FIELD_TYPE = {Kind.NUMBER: FieldType.DOUBLE, Kind.INTEGER: FieldType.INT64, Kind.TEXT: FieldType.STRING}
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


class SamplesEncoder:
    """Owned by the writing thread."""

    def __init__(self) -> None:
        self._fields: dict[str, str] = {}  # column -> field
        self._declared: tuple[int, MessageType] | None = None

    def write(self, file: McapFile, row: Mapping[str, Cell], log_ns: int) -> None:
        """One sample; `row` has been checked."""
        if self._declared is None or any(column not in self._fields for column in row):
            self._declared = self._declare(
                file, (*self._fields, *(column for column in row if column not in self._fields))
            )
        topic, kind = self._declared
        values = {self._fields[column]: _value(column, cell) for column, cell in row.items() if cell is not None}
        file.write(topic, log_ns, packed(kind, values))

    def _declare(self, file: McapFile, columns: tuple[str, ...]) -> tuple[int, MessageType]:
        self._fields = field_names(columns)
        fields = (Field(field, _FIELD_TYPE[kind_of(name)], Presence.OPTIONAL) for name, field in self._fields.items())
        kind = message_type("sample", tuple(fields))
        return file.topic(SAMPLES_TOPIC, kind, {"columns": msgspec.json.encode(self._fields).decode()}), kind


def field_names(columns: tuple[str, ...]) -> dict[str, str]:
    """Column -> field of the message: the column's own name where protobuf allows it, else "column_<number>".

    Protobuf refuses two fields that differ only in case and underscores (their JSON names would be the same).
    """
    taken: set[str] = set()
    fields: dict[str, str] = {}
    for number, column in enumerate(columns, start=1):
        folded = column.replace("_", "").lower()
        if _IDENTIFIER.fullmatch(column) and folded not in taken:
            fields[column] = column
        else:
            fields[column] = f"column_{number}"
            folded = f"column{number}"
        taken.add(folded)
    return fields


def _value(column: str, cell: float | int | str) -> float | int | str:
    kind = kind_of(column)
    return str(cell) if kind is Kind.TEXT else int(cell) if kind is Kind.INTEGER else float(cell)


T = TypeVar("T")

# about five minutes of two PSDs, six encoders and a robot: a disk that stalls so long is broken
LIMIT_BYTES = 64 * 2**20


class Spool(Generic[T]):
    """Many put, one takes; `name` is the file, for messages."""

    def __init__(self, name: str, limit_bytes: int = LIMIT_BYTES) -> None:
        self._name, self._limit = name, limit_bytes
        self._changed = threading.Condition()
        self._items: list[T] = []
        self._waiting_bytes = 0
        self._put = self._written = 0  # items so far
        self._urgent = False
        self._closed = False
        self._failure: str | None = None

    def put(self, item: T, size_bytes: int) -> None:
        """Leave an item for the writing thread. RecordingError when it cannot be taken; then nothing of it is kept."""
        with self._changed:
            self._raise_failure()
            if self._closed:
                raise RecordingError(f"{self._name}: the recording is closed; nothing more can be written to it")
            if self._items and self._waiting_bytes + size_bytes > self._limit:
                raise RecordingError(
                    f"{self._name}: the disk is too slow, {self._waiting_bytes >> 20} MiB wait to be written; "
                    "record fewer channels or on another disk"
                )
            self._items.append(item)
            self._waiting_bytes += size_bytes
            self._put += 1

    def take(self, timeout_s: float) -> list[T] | None:
        """All that waits, after `timeout_s` or at once when asked to hurry; None when closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._urgent or self._closed, timeout_s)
            items, self._items = self._items, []
            self._waiting_bytes, self._urgent = 0, False
            return None if self._closed and not items else items

    def confirm(self, count: int) -> None:
        """So many more items are on the disk."""
        with self._changed:
            self._written += count
            self._changed.notify_all()

    def settle(self, timeout_s: float) -> None:
        """Wait until all that was put before is on the disk. RecordingError on failure or after `timeout_s`."""
        with self._changed:
            target = self._put
            self._urgent = True
            self._changed.notify_all()
            done = self._changed.wait_for(lambda: self._failure or self._written >= target, timeout_s)
            self._raise_failure()
            if not done:
                raise RecordingError(f"{self._name}: the disk has not answered for {timeout_s:.0f} s; check it")

    def fail(self, why: str) -> None:
        """Nothing more can be written: everyone who puts or waits is informed."""
        with self._changed:
            self._failure = why
            self._items.clear()
            self._changed.notify_all()

    def close(self) -> None:
        """No more items; the writing thread ends when it has taken the last."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def failure(self) -> str | None:
        return self._failure

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise RecordingError(self._failure)


# A killed process loses what waits and what is being written, as long again: together 0.1 s. With an own thread the
# sync costs the others nothing.
FLUSH_S = 0.05

Entry = Callable[[McapFile], None]  # what is to be written, by whom it was left

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Scribe:
    """Writes the entries of a spool until it is closed; `encoders` belong to its thread."""

    def __init__(self, file: McapFile, spool: Spool[Entry], name: str, host_s0: float) -> None:
        self._file, self._spool, self._name, self._host_s0 = file, spool, name, host_s0
        self.encoders: list[StreamEncoder] = []
        self._complete = self._ending = False
        self._thread = threading.Thread(target=self._run, name=f"write {name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def end(self, complete: bool, timeout_s: float) -> None:
        """Write what waits and close the file. RecordingError if that fails or takes longer than `timeout_s`.

        Called again, after an interrupt for instance, it waits again; the first call decides about `complete`.
        """
        if not self._ending:
            self._ending, self._complete = True, complete
        self._spool.close()
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            raise RecordingError(f"{self._name}: the disk has not answered for {timeout_s:.0f} s; check it")
        if self._spool.failure is not None:
            raise RecordingError(self._spool.failure)

    def _run(self) -> None:
        try:
            while (entries := self._spool.take(FLUSH_S)) is not None:
                self._write(entries)
            self._file.metadata(END_METADATA, {"complete": "true" if self._complete else "false"})
            self._file.finish()
        except Exception as error:  # whatever it was, nobody may wait for ever for this thread
            self._spool.fail(self._says(error))
            with contextlib.suppress(OSError):  # the failure itself has been reported already
                self._file.give_up()

    def _write(self, entries: list[Entry]) -> None:
        for entry in entries:
            entry(self._file)
        for encoder in self.encoders:
            encoder.emit(self._file)
        if entries:
            self._file.flush()
            self._spool.confirm(len(entries))

    def _says(self, error: Exception) -> str:
        safe_s = max(0.0, self._file.safe_ns * 1e-9 - self._host_s0)
        safe = f"{safe_s:.1f} s recorded are safe in {self._name}"
        if isinstance(error, OSError) and error.errno in _FULL:
            return f"disk full ({error.strerror}): {safe}; free space and resume"
        if isinstance(error, OSError):
            return f"cannot write the recording ({error.strerror}): {safe}; check the disk and resume"
        return f"cannot write the recording ({type(error).__name__}: {error}): {safe}; please report this"
