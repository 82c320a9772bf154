"""Who may look and who may press STOP: a page of this server, on this machine, or with the token.

Without a check of `Host`, a page of the world could reach a loopback server under a name of its own that resolves to
127.0.0.1 (DNS rebinding); without one of `Origin`, it could open the websocket or press STOP from the operator's
browser, for both ignore the same-origin policy. Source: RFC 6455, section 10.2; OWASP, WebSocket Security.
"""

import hmac
import ipaddress
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
NO_TOKEN = "This page needs its token: open the whole address that calibeam has printed, ?token=... included.\n"  # noqa: S105 - no password
ELSEWHERE = "Refused: asked by a page of another site, or under a name that is not this machine's.\n"
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
            return PlainTextResponse(ELSEWHERE, 403, HEADERS)
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
