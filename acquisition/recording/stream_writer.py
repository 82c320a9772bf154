"""What a reader thread holds: takes its device's samples, notices what is missing, never waits for the disk."""

import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from acquisition.recording.mcap.write_thread import Piece
from acquisition.recording.stream import Channel, Floats, Gap

LARGEST = np.iinfo(np.int64).max


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
                self._put_gap(gap)

    def gap(self, gap: Gap) -> None:
        """Record that samples are missing, where the caller knows more than the sequence shows: a lost cable."""
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
