"""The live page as a server in a thread of its own, beside whatever feeds it."""

import asyncio
import math
import secrets
import socket
import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, cast
from urllib.parse import quote

import uvicorn

from acquisition.errors import AcquisitionError
from acquisition.recording.rig import Rig
from calibeam.live.app import LOOPBACK_NAMES, Rules, is_loopback, live_app
from calibeam.live.composer import Composer
from calibeam.live.health import Latest
from calibeam.live.limits import ACCEPTED_AT_ONCE, LimitedHttp, LimitedServer, LimitedWebSocket, Limits
from calibeam.live.messages import Job
from calibeam.live.stopping import Viewers, watched_pages
from drivers.clock import Clock

TOKEN_BYTES = 18  # 24 characters of an address; guessed at a thousand a second, it takes longer than the universe
PATIENCE_S = 5.0  # until it serves, and until it has ended


class PageError(AcquisitionError):
    """The page cannot be served."""


@dataclass(frozen=True)
class PageAddress:
    """Where it is served. `port` 0: any that is free. `token` None: none on loopback, else one made at random."""

    host: str = "127.0.0.1"
    port: int = 8765
    token: str | None = None


@dataclass(frozen=True)
class LivePage:
    """A page that is served. `url` opens it, with its token."""

    feed: Latest
    url: str


@contextmanager
def live_page(
    rig: Rig, clock: Clock, address: PageAddress, job: Job = "session", limits: Limits | None = None
) -> Generator[LivePage]:
    """Served inside. PageError when that cannot be. The end of the page stops nothing."""
    listening = _listen(address)
    port = int(listening.getsockname()[1])
    token = address.token or (None if is_loopback(address.host) else secrets.token_urlsafe(TOKEN_BYTES))
    names = LOOPBACK_NAMES | {address.host} if is_loopback(address.host) else None
    latest = Latest(clock)
    rules = Rules(port, token, names)
    serving = _Serving(Composer(rig, latest, job), latest, rules, limits or Limits(), listening)
    limit_s = rig.live.stop_without_page_s if job == "session" else None  # who only watches owns no motion
    with serving.running(), watched_pages(latest.stop, serving.viewers, limit_s, clock):
        yield LivePage(latest, _url(address.host, port, token))


class _Serving:
    """uvicorn in a thread."""

    def __init__(
        self, composer: Composer, latest: Latest, rules: Rules, limits: Limits, listening: socket.socket
    ) -> None:
        self.viewers = Viewers(latest.clock)
        self._socket = listening
        config = uvicorn.Config(
            live_app(composer, latest.stop, self.viewers, rules, limits),
            lifespan="on",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            server_header=False,
            backlog=ACCEPTED_AT_ONCE,
            timeout_keep_alive=math.ceil(limits.request_s),
            http=cast(Any, partial(LimitedHttp, limits=limits)),  # uvicorn calls it, and asks for a class
            ws=cast(Any, partial(LimitedWebSocket, limits=limits)),
            ws_per_message_deflate=False,  # would cost more than the bytes it saves on a local line
            ws_max_size=limits.viewer_message_bytes,
            timeout_graceful_shutdown=1,
        )
        self._server = LimitedServer(config)
        self._thread = threading.Thread(target=self._run, name="live page", daemon=True)

    @contextmanager
    def running(self) -> Generator[None]:
        self._thread.start()
        try:
            yield
        finally:
            self._server.should_exit = True
            self._thread.join(PATIENCE_S)
            self._socket.close()

    def _run(self) -> None:
        asyncio.run(self._server.serve(sockets=[self._socket]))


def _listen(address: PageAddress) -> socket.socket:
    """Bound and listening at once: a page opened right after the address was printed is served."""
    try:
        family, _, _, _, where = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise PageError(
            f"live page: {address.host}: {error.strerror or error}; give an address of this machine"
        ) from error
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(where)
        listening.listen()
    except OSError as error:
        listening.close()
        raise PageError(
            f"live page: {address.host}:{address.port}: {error.strerror or error}; another program has it, "
            "or the address is not this machine's: choose another port or host"
        ) from error
    return listening


def _url(host: str, port: int, token: str | None) -> str:
    """With a name that another machine can use where the server listens on all addresses."""
    shown = socket.gethostname() if host in ("0.0.0.0", "::") else host  # noqa: S104 - compared, not bound
    shown = f"[{shown}]" if ":" in shown else shown
    return f"http://{shown}:{port}/" + ("" if token is None else f"?token={quote(token, safe='')}")
