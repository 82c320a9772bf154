"""What browsers, or many slow connections, may take of the program: files, time, bytes (numbers: docs/live.md).

uvicorn limits neither the time for a header nor the number of connections that have not sent one, so silent connections
would use up every file that the process may open. Both limits belong where a connection begins: in the protocols that
uvicorn makes for it. A newcomer is not refused because of silent ones: the connection that has waited longest is closed
instead, because a STOP comes as a new connection.
"""

import asyncio
import socket
from dataclasses import dataclass
from typing import Any, Protocol, cast

import uvicorn
from h11 import Request
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

ACCEPTED_AT_ONCE = 32  # a turn of the loop; within some turns those that are too many are closed
QUEUE = (
    1024  # connections that wait in the system and need no file here; when it is full, a newcomer waits 1 s and more
)
CLOSING_S = 1.0  # for a viewer's answer to the end of its connection
POLICY, TOO_MANY = 1008, 1013  # RFC 6455, registry of close codes: policy violation, try again later (link.js)
TOO_LONG = b"Refused: the request is too long.\n"


@dataclass(frozen=True)
class Limits:
    """Of one page. `connections` counts requests and viewers together."""

    connections: int = 64
    viewers: int = 16
    request_s: float = 5.0  # from the connection, or the last answer, until a header is complete
    answer_s: float = 20.0  # from then on until the answer was taken
    silent_viewer_s: float = 30.0  # without an acknowledgement
    request_bytes: int = 16_384  # header and body
    viewer_message_bytes: int = 64
    viewer_bytes_a_second: int = 2_048


class _Connection(Protocol):
    """A member of uvicorn's set of connections."""

    since_s: float  # of the loop's clock: made, or last answered
    transport: asyncio.Transport

    @property
    def expendable(self) -> bool:
        """Whether it may be closed to make room."""
        ...


class LimitedHttp(H11Protocol):
    """A connection for requests."""

    def __init__(self, *arguments: Any, limits: Limits, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._limits = limits
        self._due: asyncio.TimerHandle | None = None
        self._answering: RequestResponseCycle | None = None
        self._bytes = 0  # of this request
        self.since_s = self.loop.time()

    @property
    def expendable(self) -> bool:
        """All but an action under way: its answer reports whether the STOP was delivered."""
        return not self._in_an_answer or self.scope["method"] != "POST"

    @property
    def _in_an_answer(self) -> bool:
        cycle = cast(RequestResponseCycle | None, self.cycle)
        return cycle is not None and not cycle.response_complete

    def connection_made(self, transport: asyncio.Transport) -> None:  # pyright: ignore[reportIncompatibleMethodOverride] - as uvicorn's
        super().connection_made(transport)
        self._await_request(self._limits.request_s)
        there = [cast(_Connection, each) for each in self.connections]
        alive = [each for each in there if not each.transport.is_closing()]
        if len(alive) > self._limits.connections:
            spare = [each for each in alive if each.expendable and each is not self]
            min(spare, key=lambda each: each.since_s, default=self).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._expect(None)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        self._bytes += len(data)
        if self._bytes > self._limits.request_bytes:
            self._refuse()
        else:
            super().data_received(data)

    def handle_events(self) -> None:
        super().handle_events()
        if self.cycle is not self._answering:  # a header is complete
            self._answering = self.cycle
            self._expect(self._limits.answer_s)

    def handle_websocket_upgrade(self, event: Request) -> None:
        self._expect(None)
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        taken = not self.transport.get_write_buffer_size()
        self._await_request(self._limits.request_s if taken else self._limits.answer_s)
        super().on_response_complete()

    def _await_request(self, within_s: float) -> None:
        self._bytes, self.since_s = 0, self.loop.time()
        self._expect(within_s)

    def _expect(self, within_s: float | None) -> None:
        """The next step within this time, or the connection ends; None: not limited from here on."""
        if self._due is not None:
            self._due.cancel()
        self._due = None if within_s is None else self.loop.call_later(within_s, self.transport.abort)

    def _refuse(self) -> None:
        if not self._in_an_answer:
            head = f"HTTP/1.1 413 Content Too Large\r\nconnection: close\r\ncontent-length: {len(TOO_LONG)}\r\n\r\n"
            self.transport.write(head.encode() + TOO_LONG)
        self.transport.close()  # what is not taken by the time that is due anyway is given up


class LimitedWebSocket(WebSocketsSansIOProtocol):
    """A viewer's connection. Bytes and not messages are counted: pings and empty fragments are no messages."""

    def __init__(self, *arguments: Any, limits: Limits, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._limits = limits
        self.close_timeout = CLOSING_S
        self.since_s = self._second_s = self.loop.time()
        self._bytes = -limits.request_bytes  # in this second; the header of the handshake comes this way too

    @property
    def expendable(self) -> bool:
        """Viewers are limited by themselves; one that was refused only waits for its end."""
        return self.close_sent

    def data_received(self, data: bytes) -> None:
        now_s = self.loop.time()
        if now_s - self._second_s >= 1.0:
            self._second_s, self._bytes = now_s, 0
        self._bytes += len(data)
        if self._bytes <= self._limits.viewer_bytes_a_second:
            super().data_received(data)
        elif not self.close_sent:
            self.conn.fail(POLICY, "too many messages")
            self.transport.write(b"".join(self.conn.data_to_send()))
            self.close_sent = True
            self.transport.close()


class LimitedServer(uvicorn.Server):
    """asyncio takes as many connections a turn as the system's queue is long: here fewer."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        for listening in sockets or ():
            listening.listen(QUEUE)
