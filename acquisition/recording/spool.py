"""The bounded queue between the threads that measure and the one thread that writes.

Whoever measures must not wait for a disk, and a disk that falls behind must not go unnoticed. So `put` never blocks: it
raises when the limit is reached, when writing has failed, and when the recording is closed.
"""

import threading
from typing import Generic, TypeVar

from acquisition.recording.errors import RecordingError

T = TypeVar("T")

LIMIT_BYTES = (
    64 * 2**20
)  # about five minutes of two PSDs, six encoders and a robot: a disk that stalls so long is broken


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
        """Nothing more can be written: everyone who puts or waits is told."""
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
