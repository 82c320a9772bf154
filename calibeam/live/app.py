"""The web application: the page as static files, one websocket that it listens to, STOP, and who may use them.

While a page is open it gets the newest picture 30 times a second and the state 4 times a second.

A page of this server may look and press STOP, on this machine or with the token. Without a check of `Host`, a page of
the world could reach a loopback server under a name of its own that resolves to 127.0.0.1 (DNS rebinding); without one
of `Origin`, it could open the websocket or press STOP from the operator's browser, for both ignore the same-origin
policy. Source: RFC 6455, section 10.2; OWASP, WebSocket Security.
"""

import asyncio
import hmac
import ipaddress
from collections.abc import AsyncGenerator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs

from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from calibeam.live.composer import Composer
from calibeam.live.limits import TOO_MANY, Limits
from calibeam.live.messages import Picture
from calibeam.live.stopping import ON_THE_WAY, Stop, Viewer, Viewers

LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
PRESSES = 64  # of STOP at one time, each until the controller has taken it or is known not to
NO_TOKEN = "This page needs its token: open the whole address that calibeam has printed, ?token=... included.\n"  # noqa: S105 - no password
OTHER_SITE = "Refused: asked by a page of another site, or under a name that is not this machine's.\n"
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",  # the first address holds the token
    "Cache-Control": "no-store",  # a page of an older program must not be shown again
}


def is_loopback(host: str) -> bool:
    """Whether nobody else reaches this address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Rules:
    """`token` None: none is asked for. `names`: what this server may be called; None: anything, the token decides."""

    port: int
    token: str | None
    names: frozenset[str] | None

    @property
    def cookie(self) -> str:
        """Its name; cookies do not know ports, and two servers may run on one machine."""
        return f"calibeam-{self.port}"

    def knows(self, headers: Headers, query: str) -> bool:
        """Whether the token is there and right, in the cookie or in the address."""
        if self.token is None:
            return True
        given = [*parse_qs(query).get("token", []), *self._crumbs(headers)]
        return any(hmac.compare_digest(one.encode(), self.token.encode()) for one in given)

    def is_named(self, headers: Headers) -> bool:
        """Whether it was asked by a name that it has."""
        return self.names is None or _host_of(headers.get("host", "")) in self.names

    def is_own(self, headers: Headers) -> bool:
        """Whether a page of this server asks."""
        return headers.get("origin", "") == f"http://{headers.get('host', '')}"

    def _crumbs(self, headers: Headers) -> list[str]:
        try:
            crumb = SimpleCookie(headers.get("cookie", "")).get(self.cookie)
        except CookieError:
            return []
        return [] if crumb is None else [crumb.value]


class Guard:
    """Around the whole application: what is refused here reaches nothing behind it."""

    def __init__(self, app: ASGIApp, rules: Rules) -> None:
        self._app, self._rules = app, rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers, query = Headers(scope=scope), scope["query_string"].decode("latin-1")
        refusal = self._refusal(scope, headers, query)
        if refusal is None:
            await self._app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await receive()  # its "connect"
            await send({"type": "websocket.close", "code": 1008, "reason": "refused"})
        else:
            await refusal(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Headers, query: str) -> Response | None:
        acts = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        if not self._rules.is_named(headers) or (acts and not self._rules.is_own(headers)):
            return PlainTextResponse(OTHER_SITE, 403, HEADERS)
        if not self._rules.knows(headers, query):
            return PlainTextResponse(NO_TOKEN, 401, HEADERS)
        if self._rules.token is not None and not acts and "token" in parse_qs(query):
            answer = RedirectResponse(scope["path"], 303, HEADERS)  # out of the address bar, and of the history
            # A strict one would not travel on to / where the address was clicked on another site; Origin guards STOP.
            answer.set_cookie(self._rules.cookie, self._rules.token, httponly=True, samesite="lax")
            return answer
        return None


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(HEADERS)
        await send(message)

    return sending


def _host_of(host: str) -> str:
    """Without its port and brackets."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0].lower()


HZ = 30.0  # more was found harmful by others, 10 to 20 too slow (docs/live.md)
STATE_EVERY = 8  # beats


@dataclass
class Pulse:
    """`hurry` has the next beat report the state."""

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
        """What cannot be made is shown on the page: it must neither end the beat, nor pass for no news, nor be hidden
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
    presses = ThreadPoolExecutor(PRESSES, "stop")

    async def page(request: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def press(request: Request) -> Response:
        """Blocks this request alone: the controller may take its time, and a second press must not wait for it."""
        who = "a page" if request.client is None else f"the page at {request.client.host}"
        stopped = await asyncio.get_running_loop().run_in_executor(presses, stop.press, who)
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
