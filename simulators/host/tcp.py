"""A listening socket and its clients, each with a wire of its own; and datagrams to one address."""

import errno
import socket
from collections.abc import Callable
from contextlib import suppress

from simulators.errors import HostError, PortBusy
from simulators.host.line import Outbox, Report
from simulators.wire import TcpPort, UdpPort, Wire

READ_BYTES = 65536
BACKLOG = 16  # clients that connect within one tick


class Connection:
    """One client. `alive` turns False when it has gone, was dropped, or its wire has ended it."""

    def __init__(self, client: socket.socket, wire: Wire, place: str, report: Report, pace: float) -> None:
        self.client, self.wire = client, wire
        self._place, self._report = place, report
        self._outbox = Outbox(client.send, pace)
        self.alive = True

    def receive(self) -> None:
        """Reads what has come and answers."""
        try:
            data = self.client.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.alive = False
            return
        self._exchange(lambda: self.wire.handle(data), self._answer)

    def gather_due(self) -> None:
        """Takes what became due; called once a tick. Of a client that does not read, the wire is not even asked."""
        if self.alive and self._takes_stream():
            self._exchange(self.wire.due, self._outbox.gather)

    def send(self) -> None:
        """Sends what was gathered."""
        try:
            self._outbox.flush()
        except OSError:
            self.alive = False
        if getattr(self.wire, "closing", False) and self._outbox.empty:
            self.alive = False

    def _takes_stream(self) -> bool:
        try:
            return self._outbox.takes_stream()
        except OSError:
            self.alive = False
            return False

    def _exchange(self, ask: Callable[[], bytes], offer: Callable[[bytes], object]) -> None:
        try:
            data = ask()
        except Exception as fault:  # a wire at fault loses its client, and nothing else
            self._report.fault(self._place, fault)
            self.alive = False
            return
        try:
            offer(data)
        except OSError:
            self.alive = False

    def _answer(self, data: bytes) -> None:
        if not self._outbox.answer(data):
            self.alive = False  # it asks and never reads


class Listener:
    """Opens on construction. PortBusy when the address is taken, HostError when it cannot be had at all."""

    def __init__(self, port: TcpPort, report: Report, pace: float = 1.0) -> None:
        self._port, self._report, self._pace = port, report, pace
        self.socket = _listen(port)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port; the port is the one given by the system when 0 was asked for."""
        host, port = self.socket.getsockname()[:2]
        return host, port

    def accept(self) -> Connection | None:
        """The client that knocks; None when it has gone already or the wire refuses it."""
        try:
            client, _ = self.socket.accept()
        except OSError:
            return None
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            wire = self._port.accept()
        except Exception as fault:  # an instrument that has no wire left must not end the others
            self._report.fault(self._port.name, fault)
            client.close()
            return None
        return Connection(client, wire, self._port.name, self._report, self._pace)

    def bid_farewell(self, connection: Connection) -> None:
        """Closes a connection and informs the instrument."""
        connection.client.close()
        try:
            self._port.closed(connection.wire)
        except Exception as fault:  # see above
            self._report.fault(self._port.name, fault)

    def close(self) -> None:
        self.socket.close()


def _listen(port: TcpPort) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setblocking(False)
        listener.bind((port.host, port.port))
        listener.listen(BACKLOG)
    except OSError as error:
        listener.close()
        raise _explained(port, error) from error
    return listener


def _explained(port: TcpPort, error: OSError) -> HostError:
    where = f"{port.name}: {port.host}:{port.port}"
    if error.errno == errno.EADDRINUSE:
        return PortBusy(
            f"{where} is in use by another program; stop it or take another address (--robot-host auto)", port.host
        )
    if error.errno == errno.EADDRNOTAVAIL:
        return HostError(f"{where} is no address of this machine; emulate on one of 127.0.0.x")
    return HostError(f"{where} cannot be opened: {error.strerror or error}; take another address")


class UdpSender:
    """Sends datagrams. Nobody need be there: what a network refuses is lost, as on site."""

    def __init__(self, port: UdpPort, report: Report) -> None:
        self._port, self._report = port, report
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send_due(self) -> None:
        """What became due, as one datagram; called once a tick."""
        try:
            data = self._port.wire.due()
        except Exception as fault:  # a wire at fault must not end the other instruments
            self._report.fault(self._port.name, fault)
            return
        if data:
            with suppress(OSError):  # refused by a port that nobody has, or no room
                self._socket.sendto(data, (self._port.host, self._port.port))

    def close(self) -> None:
        self._socket.close()
