"""Every CAN frame into the recording, in blocks: what a tap on the bus hears, from whichever thread."""

import threading
from collections.abc import Callable, Sequence
from typing import Protocol

import can
import numpy as np
from numpy.typing import ArrayLike

from acquisition.recording import Channel, RecordingError
from acquisition.recording.can_frames import (
    CLASSIC_BYTES,
    FD_BYTES,
    FD_STREAM,
    STREAM,
    Frame,
    FrameBlock,
    FrameFlag,
    block_of,
    channels,
)
from acquisition.recording.can_log import frame_of, plain_block
from acquisition.recording.rig.devices import HARDWARE_STAMPS
from drivers.clock import Clock
from drivers.device import Stamps

_ERROR = int(FrameFlag.ERROR)  # comparing with a member of an enumeration takes ten times as long
BLOCK_S = 0.02  # as long as the encoder driver gathers rows: more would only lengthen what a kill loses


class FrameStream(Protocol):
    """Where blocks go: a stream of a recording, or of one that rotates."""

    def append(
        self, host_s: ArrayLike, device_s: ArrayLike, sequence: ArrayLike, values: dict[str, np.ndarray]
    ) -> None: ...


class Streams(Protocol):
    """A recording, or one that rotates."""

    def stream(
        self,
        name: str,
        channels: tuple[Channel, ...],
        viewer: tuple[str, ...] | None = None,
        *,
        stamps: Stamps = "unknown",
    ) -> FrameStream:
        """Declare a stream."""
        ...


def frame_stamps(interface: str, *, asked: bool = False) -> Stamps:
    """What the stamps of frames are, by python-can's name of the interface; `asked`: the rig file asks for stamps."""
    if interface == "socketcan":  # the kernel's, unless the adapter's own are asked for, which python-can does not
        return "arrived"
    return "hardware" if asked or interface in HARDWARE_STAMPS else "unknown"


class FrameLog:
    """`hear` is a tap. Frames wait BLOCK_S at most while others follow; `flush` writes the last of a quiet bus.

    Frames of CAN FD that are longer than a classic one get a stream of their own, declared when the first comes.
    """

    def __init__(self, recording: Streams, clock: Clock, stamps: Stamps = "unknown") -> None:
        self._stamps: Stamps = stamps
        self.count = 0  # frames heard so far
        self.errors = 0  # error frames among them
        self._recording = recording
        self._classic = _Counted(recording.stream(STREAM, channels(CLASSIC_BYTES), viewer=(), stamps=stamps))
        self._long: _Counted | None = None
        self._now_s: Callable[[], float] = clock.now_s
        self._turn = threading.Lock()
        self._heard: list[tuple[Sequence[can.Message], float, bool]] = []
        self._failure: RecordingError | None = None

    def hear(self, messages: Sequence[can.Message], sent: bool) -> None:
        """Never raises, for what a tap raises looks to a driver like a fault of the bus; `flush` does."""
        now_s = self._now_s()
        with self._turn:
            self._heard.append((messages, now_s, sent))  # frames are made of them later: here every microsecond counts
            if now_s - self._heard[0][1] >= BLOCK_S:
                try:
                    self._write()
                except RecordingError as failure:
                    self._failure = self._failure or failure

    def flush(self) -> None:
        """Whatever waits, now. RecordingError when the recording failed, now or at an earlier frame."""
        with self._turn:
            self._write()
            if self._failure is not None:
                raise self._failure

    def _write(self) -> None:
        heard, self._heard = self._heard, []
        if not heard:
            return
        block = plain_block(heard)
        if block is not None:
            self.count += len(block.host_s)
            self._classic.append(block)
            return
        frames = [frame_of(message, host_s, sent=sent) for messages, host_s, sent in heard for message in messages]
        self.count += len(frames)
        self.errors += sum([frame.flags & _ERROR > 0 for frame in frames])
        long = [frame for frame in frames if len(frame.data) > CLASSIC_BYTES]
        if long:
            self._write_long(long)
            frames = [frame for frame in frames if len(frame.data) <= CLASSIC_BYTES]
        self._classic.append(block_of(frames, CLASSIC_BYTES))

    def _write_long(self, frames: Sequence[Frame]) -> None:
        if self._long is None:
            self._long = _Counted(self._recording.stream(FD_STREAM, channels(FD_BYTES), viewer=(), stamps=self._stamps))
        self._long.append(block_of(frames, FD_BYTES))


class _Counted:
    """A stream of frames, numbered as they come."""

    def __init__(self, stream: FrameStream) -> None:
        self._stream, self._next = stream, 0

    def append(self, block: FrameBlock) -> None:
        if not block.host_s.size:
            return
        first, self._next = self._next, self._next + block.host_s.size
        self._stream.append(block.host_s, block.device_s, np.arange(first, self._next), block.values)
