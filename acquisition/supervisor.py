"""Stops the arm when any device fails, and lets the session know at its next step."""

import threading
from collections.abc import Callable
from contextlib import suppress

from drivers.errors import DeviceError


class Supervisor:
    """Owns the first failure of a session. `stop_arm` must work from any thread."""

    def __init__(self, stop_arm: Callable[[], None]) -> None:
        self._stop_arm = stop_arm
        self._lock = threading.Lock()
        self.failure: Exception | None = None

    def failed(self, failure: Exception) -> None:
        """A device, or the recording, cannot go on: stop the arm now; later failures are followers of the first.

        Called from reader threads, so it never raises: an arm that does not take the stop is told of by the session,
        which stops it again.
        """
        with self._lock:
            first, self.failure = self.failure is None, self.failure or failure
        if first:
            with suppress(DeviceError):
                self._stop_arm()

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self.failure is not None:
            raise self.failure
