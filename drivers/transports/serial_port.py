"""A serial port, found by path or by USB serial number, opened for one program only.

pyserial reports an unplugged port in several ways (SerialException, OSError 5 or 6, termios.error, and TypeError when
closed by another thread; pyserial issues 331, 506): here all of them become DeviceLost, with the cause kept.
"""

import errno
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import serial
from serial.tools import list_ports

from drivers.clock import Clock
from drivers.errors import DeviceLost

PURGE_DWELL_S = 0.05  # APT communications protocol, "Implementing the protocol": before and after the purge


def _errors_of_a_gone_port() -> tuple[type[Exception], ...]:
    try:
        from termios import error as terminal_error
    except ImportError:  # Windows
        return (OSError,)
    return (OSError, terminal_error)  # SerialException is an OSError, termios.error is not


GONE = _errors_of_a_gone_port()
BUSY = (errno.EBUSY, errno.EAGAIN, errno.EACCES)
NO_MODEM_LINES = (errno.ENOTTY, errno.EINVAL)


@dataclass(frozen=True)
class SerialAddress:
    """Where a serial device is: exactly one of the path of its port and the serial number of its USB plug.

    A path changes when plugs are changed round, the serial number does not.
    """

    port: str | None = None
    serial_number: str | None = None

    def __post_init__(self) -> None:
        if (self.port is None) == (self.serial_number is None):
            raise ValueError(
                f"serial address: port {self.port!r}, serial_number {self.serial_number!r}; give exactly one of them"
            )

    def __str__(self) -> str:
        return self.port if self.port is not None else f"USB serial number {self.serial_number}"


class SerialLine:
    """An open serial port as a `Transport`. DeviceLost when it cannot be opened, naming port and remedy."""

    def __init__(self, port: str, baud: int) -> None:
        self.name = port
        self._serial = _open(port, baud)

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        with _lost(self.name, "reading"):
            waiting = self._serial.in_waiting
            if waiting == 0:
                self._wait_at_most(timeout_s)
                first = self._serial.read(1)
                waiting = min(self._serial.in_waiting, max_bytes - 1) if first else 0
                return bytes(first + self._serial.read(waiting)) if waiting else bytes(first)
            return bytes(self._serial.read(min(waiting, max_bytes)))

    def write(self, data: bytes, timeout_s: float) -> None:
        with _lost(self.name, "writing"):
            if self._serial.write_timeout != timeout_s:
                self._serial.write_timeout = timeout_s
            self._serial.write(data)

    def begin_apt(self, clock: Clock) -> None:
        """What a Thorlabs unit wants of its FTDI plug: short latency, purge, flow control, RTS. DeviceLost.

        An FTDI chip keeps back less than 62 bytes for 16 ms unless set otherwise: replies of 18 would come at 60 Hz.
        A port without modem lines (pseudo-terminal, socket) is no FTDI plug: nothing of this is done.
        Source: Thorlabs, APT communications protocol, "Implementing the protocol" (order and dwell times).
        """
        with _lost(self.name, "preparing"):
            try:
                self._serial.rts = True
            except OSError as cause:
                if cause.errno in NO_MODEM_LINES:
                    return
                raise
            with suppress(ValueError, NotImplementedError, AttributeError, OSError):  # other systems set it elsewhere
                self._serial.set_low_latency_mode(True)
            clock.sleep_s(PURGE_DWELL_S)
            self._serial.reset_input_buffer()
            self._serial.reset_output_buffer()
            clock.sleep_s(PURGE_DWELL_S)
            self._serial.rtscts = True
            self._serial.rts = True

    def close(self) -> None:
        try:
            if self._serial.is_open:
                self._serial.cancel_read()
            self._serial.close()
        except GONE:
            pass  # the port has gone already: nothing is left to release

    def _wait_at_most(self, timeout_s: float) -> None:
        if self._serial.timeout != timeout_s:  # setting it configures the port again: only when it changes
            self._serial.timeout = max(timeout_s, 0.0)


def open_serial(
    address: SerialAddress, baud: int, ports: Callable[[], Iterable[Any]] = list_ports.comports
) -> SerialLine:
    """The line at `address`, `baud` bit/s. DeviceLost when there is none, it is busy or may not be opened."""
    if address.port is not None:
        return SerialLine(address.port, baud)
    return SerialLine(find_port(str(address.serial_number), ports), baud)


def find_port(serial_number: str, ports: Callable[[], Iterable[Any]] = list_ports.comports) -> str:
    """Path of the port whose USB plug has `serial_number`. DeviceLost naming those that are there."""
    present = [port for port in ports() if port.serial_number]
    for port in present:
        if port.serial_number == serial_number:
            return str(port.device)
    seen = ", ".join(f"{port.serial_number} at {port.device}" for port in present) or "none with a serial number"
    raise DeviceLost(
        f"serial port: no USB plug with serial number {serial_number!r}; present: {seen}; "
        "check cable and power, or name the port by its path"
    )


def _open(port: str, baud: int) -> serial.Serial:
    try:
        return serial.Serial(port, baud, timeout=0.0, write_timeout=1.0, exclusive=True)
    except (*GONE, ValueError) as cause:
        raise DeviceLost(_why_not(port, cause)) from cause


def _why_not(port: str, cause: Exception) -> str:
    number = getattr(cause, "errno", None)
    if number == errno.ENOENT:
        return f"serial port {port}: does not exist; check the cable, or the name in the rig file"
    if number == errno.EACCES:
        return f"serial port {port}: not permitted; add yourself to the group that owns it (often 'dialout')"
    if number in BUSY or "exclusively lock" in str(cause):
        return f"serial port {port}: busy; another program has it open, close that one first"
    return f"serial port {port}: cannot be opened ({cause}); check the cable and that it is a serial port"


@contextmanager
def _lost(port: str, doing: str) -> Generator[None]:
    """Converts what pyserial raises for a port that has gone, was closed, or does not take our bytes."""
    try:
        yield
    except serial.SerialTimeoutException as cause:
        raise DeviceLost(
            f"serial port {port}: takes no more bytes; the device does not read, check that it is powered"
        ) from cause
    except (*GONE, TypeError) as cause:
        raise DeviceLost(f"serial port {port}: gone while {doing} ({cause}); check cable and power") from cause
