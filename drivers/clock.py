"""Host time comes in through the front door.

Liveness (is the cable still in?) is judged by the host clock; physics (has the arm settled, how long did it dwell?)
by the time stamps of the devices. So the same code runs against emulators that are faster than real time.
"""

import time
from typing import Protocol


class Clock(Protocol):
    """Monotonic host time in seconds; tests pass one that jumps."""

    def now_s(self) -> float: ...

    def sleep_s(self, seconds: float) -> None: ...


class SystemClock:
    """The machine's own monotonic clock."""

    def now_s(self) -> float:
        return time.monotonic()

    def sleep_s(self, seconds: float) -> None:
        time.sleep(seconds)
