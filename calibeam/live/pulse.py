"""The beat of the page: the newest 30 times a second, how things stand 4 times, and nothing while nobody looks."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field

from calibeam.live.composer import Composer
from calibeam.live.messages import Picture
from calibeam.live.viewers import Viewers

HZ = 30.0  # more was found harmful by others, 10 to 20 too slow (docs/live.md)
STATE_EVERY = 8  # beats


@dataclass
class Pulse:
    """`hurry` has the next beat tell how things stand."""

    viewers: Viewers
    composer: Composer
    _beats: int = field(default=0, init=False)

    def hurry(self) -> None:
        self._beats = 0

    async def run(self) -> None:
        """Until cancelled."""
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            if not self.viewers.some.is_set():
                await self.viewers.some.wait()
                due_s = loop.time()
            self._beat()
            due_s = max(due_s + 1.0 / HZ, loop.time())  # a missed beat is not made up for
            await asyncio.sleep(due_s - loop.time())

    def _beat(self) -> None:
        if self._beats % STATE_EVERY == 0:
            self._tell("state", self.composer.state)
        self._tell("now", self.composer.now)
        self._beats += 1

    def _tell(self, kind: Picture, made: Callable[[], str]) -> None:
        """What cannot be made is told on the page: it must neither end the beat, nor pass for no news, nor be hidden
        by what can.
        """
        try:
            self.viewers.post(kind, made())
        except Exception as error:  # whatever it was
            self.viewers.post(f"trouble of {kind}", self.composer.trouble(kind, error))
