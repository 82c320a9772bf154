"""The web application: the page as static files, one websocket that it listens to, and STOP.

While a page is open it gets the newest picture 30 times a second and the state 4 times a second.
"""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from calibeam.live.access import Guard, Rules
from calibeam.live.composer import Composer
from calibeam.live.limits import TOO_MANY, Limits
from calibeam.live.messages import Picture
from calibeam.live.stopping import Stop
from calibeam.live.viewers import ON_THE_WAY, Viewer, Viewers

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


COUNTS = frozenset(map(str, range(1, ON_THE_WAY + 1)))
STATIC = Path(__file__).parent / "static"


def live_app(composer: Composer, stop: Stop, viewers: Viewers, rules: Rules, limits: Limits) -> ASGIApp:
    """Everything behind its guard. `viewers` must be made in the event loop that serves."""
    pulse = Pulse(viewers, composer)

    async def page(request: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def press(request: Request) -> Response:
        """Blocks this request alone: the controller may take its time, and a second press must not wait for it."""
        who = "a page" if request.client is None else f"the page at {request.client.host}"
        stopped = await asyncio.to_thread(stop.press, who)
        pulse.hurry()
        return JSONResponse({"delivered": stopped.delivered, "says": stopped.says})

    async def feed(socket: WebSocket) -> None:
        await socket.accept()
        if len(viewers) >= limits.viewers:
            await socket.close(TOO_MANY, "too many pages are open")
            return
        viewer = Viewer()
        viewer.post("rig", composer.rig())
        viewers.add(viewer)
        pulse.hurry()
        sending = asyncio.create_task(_send(socket, viewer))
        try:
            with suppress(WebSocketDisconnect):
                while True:
                    async with asyncio.timeout(limits.silent_viewer_s):
                        count = await socket.receive_text()  # how many messages it has taken
                    viewers.taken(viewer, int(count) if count in COUNTS else 0)
        except TimeoutError:
            await socket.close(reason="nothing was acknowledged")
        finally:
            viewers.remove(viewer)
            sending.cancel()

    @asynccontextmanager
    async def beating(app: Starlette) -> AsyncGenerator[None]:
        beat = asyncio.create_task(pulse.run())
        try:
            yield
        finally:
            beat.cancel()

    routes = [
        Route("/", page),
        Route("/stop", press, methods=["POST"]),
        WebSocketRoute("/feed", feed),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    return Guard(Starlette(routes=routes, lifespan=beating), rules)


async def _send(socket: WebSocket, viewer: Viewer) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):  # gone between two messages: the receiver hears of it
        while True:
            await socket.send_text(await viewer.next())
