"""The serial line out of the box, with the time that bytes take and a transmit buffer that can overflow."""

from collections import deque

BITS_PER_BYTE = 10  # start bit, 8 data bits, stop bit
DEFAULT_BAUD = 3_000_000
BUFFER_BYTES = 4096  # as a small microcontroller has; 11 ms at 3 Mbaud


class TransmitLine:
    """Frames leave one after the other: each ends not before the previous one did, plus its own bytes' time."""

    def __init__(self, baud: int = DEFAULT_BAUD) -> None:
        self._byte_s = BITS_PER_BYTE / baud
        self._queue: deque[tuple[float, bytes]] = deque()
        self._free_s = 0.0  # when the last queued frame has left
        self.dropped = 0  # frames that found the buffer full

    def send(self, frame: bytes, ready_s: float) -> None:
        """Queue a frame that is ready at `ready_s`; dropped whole when the buffer has no room for it."""
        waiting = (self._free_s - ready_s) / self._byte_s
        if waiting + len(frame) > BUFFER_BYTES:
            self.dropped += 1
            return
        self._free_s = max(self._free_s, ready_s) + len(frame) * self._byte_s
        self._queue.append((self._free_s, frame))

    def delivered(self, now_s: float) -> bytes:
        """What has fully left by `now_s` and was not fetched yet."""
        out = bytearray()
        while self._queue and self._queue[0][0] <= now_s:
            out += self._queue.popleft()[1]
        return bytes(out)

    def clear(self) -> None:
        self._queue.clear()
