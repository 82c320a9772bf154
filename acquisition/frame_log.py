"""Every CAN frame into the recording, in blocks: what a tap on the bus hears, from whichever thread."""

import threading
from collections.abc import Callable
from typing import Protocol

import can
import numpy as np
from numpy.typing import ArrayLike

from acquisition.recording.can_frames import block_of
from acquisition.recording.can_message import frame_of
from drivers.clock import Clock

BLOCK_S = 0.02  # as long as the encoder driver gathers rows: more would only lengthen what a kill loses


class FrameStream(Protocol):
    """Where blocks go: a stream of a recording, or of one that rotates."""

    def append(
        self, host_s: ArrayLike, device_s: ArrayLike, sequence: ArrayLike, values: dict[str, np.ndarray]
    ) -> None: ...


class FrameLog:
    """`hear` is a tap. Frames wait BLOCK_S at most while others follow; `flush` writes the last of a quiet bus."""

    def __init__(self, stream: FrameStream, clock: Clock, width: int) -> None:
        self.count = 0  # frames heard so far
        self.errors = 0  # error frames among them
        self._stream, self._width = stream, width
        self._now_s: Callable[[], float] = clock.now_s
        self._turn = threading.Lock()
        self._heard: list[tuple[can.Message, float, bool]] = []

    def hear(self, message: can.Message, sent: bool) -> None:
        """RecordingError when the recording failed: the driver above ends with it."""
        now_s = self._now_s()
        with self._turn:
            self._heard.append((message, now_s, sent))  # a frame is made of it later: here every microsecond counts
            if now_s - self._heard[0][1] >= BLOCK_S:
                self._write()

    def flush(self) -> None:
        """Whatever waits, now."""
        with self._turn:
            self._write()

    def _write(self) -> None:
        if not self._heard:
            return
        frames = [frame_of(message, host_s, sent=sent) for message, host_s, sent in self._heard]
        self.errors += sum(message.is_error_frame for message, _, _ in self._heard)
        self._heard = []
        block = block_of(frames, self._width)
        first, self.count = self.count, self.count + len(frames)
        self._stream.append(block.host_s, block.device_s, np.arange(first, self.count), block.values)
