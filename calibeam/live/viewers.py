"""Pages that look. A slow one gets the newest of each kind once it has taken what is on the way: nothing queues."""

import asyncio

from drivers.clock import Clock

ON_THE_WAY = 6  # messages not yet taken: 30 Hz up to a tenth of a second away, told of every third (link.js)


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
