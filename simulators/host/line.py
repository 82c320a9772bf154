"""Bytes that a client has not taken yet, bounded, so that a slow client never holds up the others.

Streamed output is dropped whole when too much is waiting, as a UR controller skips RTDE packages for a client that does
not read and never sends them later (RTDE guide, "Key features"); sequence numbers or time stamps make the loss seen.
Answers are kept up to a limit that only a client which never reads can reach.
"""

from collections.abc import Callable

STREAM_LIMIT_BYTES = 64 * 1024  # 0.1 s of RTDE with every field, beyond what the kernel's own buffers hold
ANSWER_LIMIT_BYTES = 1024 * 1024  # feels right: thousands of answers that nobody has read


class Outbox:
    """`write` takes bytes and says how many it took; BlockingIOError means none now."""

    def __init__(self, write: Callable[[bytearray], int]) -> None:
        self._write = write
        self._waiting = bytearray()
        self.dropped = 0  # outputs lost because the client did not read

    @property
    def empty(self) -> bool:
        return not self._waiting

    def takes_stream(self) -> bool:
        """False, and counted, while too much waits: what would be streamed now need not even be made."""
        if len(self._waiting) <= STREAM_LIMIT_BYTES:
            return True
        self.flush()
        if len(self._waiting) <= STREAM_LIMIT_BYTES:
            return True
        self.dropped += 1
        return False

    def gather(self, data: bytes) -> None:
        """Streamed output for the next `flush`, where `takes_stream` has said yes."""
        self._waiting += data

    def stream(self, data: bytes) -> None:
        """Output that may be lost. Raises what `write` raises, except for "not now"."""
        self._offer(data, STREAM_LIMIT_BYTES)

    def answer(self, data: bytes) -> bool:
        """Output that belongs to a request; False when the client has left so much unread that it was dropped."""
        return self._offer(data, ANSWER_LIMIT_BYTES)

    def flush(self) -> None:
        """Hands over as much as goes without waiting."""
        while self._waiting:
            try:
                taken = self._write(self._waiting)
            except BlockingIOError:
                return
            del self._waiting[:taken]

    def clear(self) -> None:
        """Forgets what is waiting: the client has gone."""
        self._waiting.clear()

    def _offer(self, data: bytes, limit_bytes: int) -> bool:
        if self._waiting:
            self.flush()
        if len(self._waiting) > limit_bytes:
            self.dropped += 1
            return False
        if data:
            self._waiting += data
            self.flush()
        return True
