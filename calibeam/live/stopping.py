"""STOP: from any thread, in every state, as often as it is pressed; and what became of it.

Where the rig asks for it, a session also ends when no page answers any more (docs/decisions/0028). That is watched in
a thread of its own, so that a server that hangs is noticed as a page that does not answer.
"""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass

from calibeam.live.viewers import Viewers
from drivers.clock import Clock
from drivers.errors import DeviceError

NO_ARM = "nothing was stopped: no arm is connected to this page; press the red emergency stop if something moves"


@dataclass(frozen=True)
class Stopped:
    """What one STOP did. `delivered`: the controller took it."""

    host_s: float
    who: str
    delivered: bool
    says: str


class Stop:
    """Owns the way to the arm. Presses do not wait for each other: one that hangs keeps none from trying."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._how: Callable[[], None] | None = None
        self._telling = threading.Lock()
        self.last: Stopped | None = None

    def by(self, how: Callable[[], None] | None) -> None:
        """What to do from now on; it may raise DeviceError."""
        self._how = how

    @property
    def ready(self) -> bool:
        """Whether there is an arm."""
        return self._how is not None

    def press(self, who: str) -> Stopped:
        """Stop now; blocks until the controller has taken it, or until it is known that it does not."""
        how, host_s = self._how, self._clock.now_s()
        if how is None:
            return self._told(Stopped(host_s, who, delivered=False, says=NO_ARM))
        try:
            how()
        except DeviceError as error:
            says = f"NOT DELIVERED, press the red emergency stop now: {error}"
            return self._told(Stopped(host_s, who, delivered=False, says=says))
        return self._told(Stopped(host_s, who, delivered=True, says="the controller confirmed the stop command"))

    def _told(self, stopped: Stopped) -> Stopped:
        with self._telling:
            if self.last is None or self.last.host_s <= stopped.host_s:
                self.last = stopped
        return stopped


LOOK_S = 0.1
AGAIN_S = 1.0  # after a STOP that the controller did not take


def overdue(viewers: Viewers, limit_s: float, now_s: float) -> bool:
    """Whether there was a page once, and none has answered for so long."""
    return viewers.newest_s is not None and now_s - viewers.newest_s > limit_s


@contextmanager
def watched_pages(stop: Stop, viewers: Viewers, limit_s: float | None, clock: Clock) -> Generator[None]:
    """Inside, STOP is pressed when pages are overdue, until it is delivered; never without a limit."""
    if limit_s is None:
        yield
        return
    done = threading.Event()

    def watch() -> None:
        wait_s = LOOK_S
        while not done.wait(wait_s):
            wait_s = LOOK_S
            if stop.ready and overdue(viewers, limit_s, clock.now_s()):
                if stop.press(f"no page has answered for {limit_s:.3g} s").delivered:
                    return
                wait_s = AGAIN_S

    watcher = threading.Thread(target=watch, name="watch live pages", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        done.set()
        watcher.join()
