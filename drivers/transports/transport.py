"""Bytes in and out, with a limit on every wait: the lowest seam, where a test puts a line in memory.

Here also a TCP client and a UDP receiver; every failure is a DeviceLost that names address and remedy.
"""

import select
import socket
from collections.abc import Generator
from contextlib import contextmanager, suppress
from typing import Protocol

from drivers.errors import DeviceLost


class Transport(Protocol):
    """An open line. Raises DeviceLost when it has gone; `name` states where it leads, for messages."""

    name: str

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """What has come, at least one byte, at most `max_bytes`; b"" when nothing came within `timeout_s`."""
        ...

    def write(self, data: bytes, timeout_s: float) -> None:
        """All of `data`, or DeviceLost when the line did not take it within `timeout_s`."""
        ...

    def close(self) -> None:
        """Release the line; safe more than once, and while another thread waits in `read`."""
        ...


CONNECT_S = 2.0
DATAGRAM = 65536


class TcpLine:
    """A connection to an instrument that listens. DeviceLost when there is none."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=CONNECT_S)
        except OSError as cause:
            raise DeviceLost(
                f"{self.name}: no connection ({_why(cause)}); check that the instrument's output is switched on, its "
                "address and port, and the cable"
            ) from cause
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        with _lost(self.name, "reading"):
            self._socket.settimeout(max(timeout_s, 1e-6))  # 0 would mean: never wait, and fail
            try:
                data = self._socket.recv(max_bytes)
            except TimeoutError:
                return b""
        if not data:
            raise DeviceLost(f"{self.name}: the instrument closed the connection; switch its output on again")
        return data

    def write(self, data: bytes, timeout_s: float) -> None:
        with _lost(self.name, "writing"):
            self._socket.settimeout(timeout_s)
            self._socket.sendall(data)

    def close(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # wakes a thread that waits in `read`
        self._socket.close()


class UdpReceiver:
    """Datagrams that an instrument sends to a port of this machine; each counts as a whole number of lines.

    Bound to `host`, an address of this machine; no multicast. Who sends first is the instrument: what others send to
    the port is left out. DeviceLost when the port cannot be had.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as cause:
            self._socket.close()
            raise DeviceLost(
                f"UDP {host}:{port}: cannot be opened ({_why(cause)}); close the program that has it, or give another "
                "port of this machine"
            ) from cause
        self.port = int(self._socket.getsockname()[1])
        self.name = f"UDP {host}:{self.port}"
        self._rest = b""
        self._sender: object = None  # address of the first

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        if not self._rest:
            with _lost(self.name, "reading"):
                if not select.select([self._socket], [], [], max(timeout_s, 0.0))[0]:
                    return b""
                data, sender = self._socket.recvfrom(DATAGRAM)
            self._sender = self._sender or sender
            if sender != self._sender:
                return b""
            self._rest = data if data.endswith((b"\n", b"\r")) else data + b"\n"
        data, self._rest = self._rest[:max_bytes], self._rest[max_bytes:]
        return data

    def write(self, data: bytes, timeout_s: float) -> None:
        raise DeviceLost(f"{self.name}: only receives; an instrument that is to be asked needs TCP or a serial line")

    def close(self) -> None:
        self._socket.close()


def _why(cause: OSError) -> str:
    return cause.strerror or str(cause) or type(cause).__name__


@contextmanager
def _lost(name: str, doing: str) -> Generator[None]:
    """What a socket raises that has gone, was closed by another thread, or takes no more bytes."""
    try:
        yield
    except (OSError, ValueError) as cause:  # ValueError: select on a closed socket
        raise DeviceLost(f"{name}: gone while {doing} ({cause}); check cable and power") from cause
