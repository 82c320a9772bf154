"""Blocks of samples to messages: batches that hold everything, and a thinned view that viewers can plot.

The kind of number of a channel, whole or real, is that of its first block; so topics are declared when the first block
comes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.layout import STREAM_TOPIC, VIEW_TOPIC, log_ns
from acquisition.recording.mcap.layout import Field, FieldType, MessageType, Presence, message_type, packed
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.stream import Channel, Floats, scalar_names

BATCH = 100  # samples a message: a tenth of the time and of the size of single ones, measured with this library
VIEW_S = 0.05  # 20 Hz: as fast as an eye follows a curve

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

    def __init__(self, name: str, channels: tuple[Channel, ...], viewed: tuple[str, ...]) -> None:
        self._name, self._channels = name, channels
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
        self._batch = file.topic(STREAM_TOPIC + self._name, batch, {"channels": channels_json(self._channels)}), batch
        if self._viewed:
            names = ("host_s", *(name for channel in self._viewed for name in scalar_names(channel)))
            view = message_type(f"{identifier}_view", tuple(Field(name, FieldType.DOUBLE) for name in names))
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


def channels_json(channels: tuple[Channel, ...]) -> str:
    """The declared channels as they stand in the file; an infinite full scale is left out."""
    rows = [
        {"name": channel.name, "unit": channel.unit, "shape": list(channel.shape), "resolution": channel.resolution}
        | ({"full_scale": channel.full_scale} if np.isfinite(channel.full_scale) else {})
        for channel in channels
    ]
    return msgspec.json.encode(rows).decode()


def _joined(pieces: list[Piece]) -> Piece:
    if len(pieces) == 1:
        return pieces[0]
    return Piece(
        np.concatenate([piece.host_s for piece in pieces]),
        np.concatenate([piece.device_s for piece in pieces]),
        np.concatenate([piece.sequence for piece in pieces]),
        {name: np.concatenate([piece.values[name] for piece in pieces]) for name in pieces[0].values},
    )
