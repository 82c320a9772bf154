"""The pages that are open, and STOP: from any thread, in every state, as often as it is pressed; and its outcome.

A slow page gets the newest message of each kind once it has taken what is on the way: nothing queues. Where the rig
asks for it, a session also ends when no page answers any more (docs/decisions/0028). That is watched in a thread of its
own, so that a server that hangs is noticed as a page that does not answer.
"""

import asyncio
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass

from acquisition.wires.streams import in_thread
from drivers.clock import Clock
from drivers.errors import DeviceError

ON_THE_WAY = 6  # messages not yet taken: 30 Hz up to a tenth of a second away, every third acknowledged (link.js)


class Viewer:
    """One page, for one event loop. A message not yet sent is replaced by a newer one of its kind."""

    def __init__(self, room: int = ON_THE_WAY) -> None:
        self._mail: dict[str, str] = {}
        self._room = room
        self._news = asyncio.Event()

    def post(self, kind: str, text: str) -> None:
        self._mail[kind] = text
        self._news.set()

    def taken(self, count: int = 1) -> None:
        """The page has so many messages more."""
        self._room += count
        self._news.set()

    async def next(self) -> str:
        """The message to send now; waits until there is one, and room for it."""
        while not self._mail or self._room <= 0:
            self._news.clear()
            await self._news.wait()
        self._room -= 1
        return self._mail.pop(next(iter(self._mail)))


class Viewers:
    """All pages. `newest_s`: host time when any of them last took something; None: there never was one."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._all: set[Viewer] = set()
        self.newest_s: float | None = None
        self.some = asyncio.Event()

    def __len__(self) -> int:
        return len(self._all)

    def add(self, viewer: Viewer) -> None:
        self._all.add(viewer)
        self.some.set()

    def remove(self, viewer: Viewer) -> None:
        self._all.discard(viewer)
        if not self._all:
            self.some.clear()

    def taken(self, viewer: Viewer, count: int) -> None:
        self.newest_s = self._clock.now_s()
        viewer.taken(count)

    def post(self, kind: str, text: str) -> None:
        """To every page."""
        for viewer in self._all:
            viewer.post(kind, text)


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
            return self._reported(Stopped(host_s, who, delivered=False, says=NO_ARM))
        try:
            how()
        except DeviceError as error:
            says = f"NOT DELIVERED, press the red emergency stop now: {error}"
            return self._reported(Stopped(host_s, who, delivered=False, says=says))
        return self._reported(Stopped(host_s, who, delivered=True, says="the controller confirmed the stop command"))

    def _reported(self, stopped: Stopped) -> Stopped:
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

    def watch(done: threading.Event) -> None:
        wait_s = LOOK_S
        while not done.wait(wait_s):
            wait_s = LOOK_S
            if stop.ready and overdue(viewers, limit_s, clock.now_s()):
                if stop.press(f"no page has answered for {limit_s:.3g} s").delivered:
                    return
                wait_s = AGAIN_S

    with in_thread(watch, "watch live pages"):
        yield
