"""A serial port as a pseudo-terminal: one wire for ever, clients that come and go like a USB cable's far end.

What it does not imitate: modem lines (DTR, RTS), breaks, parity and the baud rate; a wire models its line's speed.
While no client has the port open, output is lost as on a real line.
"""

import os
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from simulators.errors import HostError
from simulators.host.line import Outbox, Report, make_link, remove_link
from simulators.wire import SerialPort

READ_BYTES = 65536


class SerialLine:
    """Opens on construction. HostError when the machine has no pseudo-terminal left or the link cannot be made."""

    def __init__(self, port: SerialPort, report: Report, pace: float = 1.0) -> None:
        self.name = port.name
        self._wire = port.wire
        self._report = report
        self._link = None if port.link is None else Path(port.link).absolute()
        self.fd, self.path = _open_terminal(port.name)
        self._outbox = Outbox(lambda data: os.write(self.fd, data), pace)
        self.attached = self.unplugged = False
        if self._link is not None:
            try:
                make_link(self.name, self._link, self.path)
            except HostError:
                os.close(self.fd)
                raise

    @property
    def address(self) -> str:
        """The path that a client opens."""
        return self.path if self._link is None else str(self._link)

    def receive(self) -> None:
        """Reads what has come and answers; notices that a client has come or gone."""
        try:
            data = os.read(self.fd, READ_BYTES)
        except BlockingIOError:
            self.attached = True
            return
        except OSError:  # EIO: nobody has the far end open
            self._detach()
            return
        self.attached = True
        try:
            answer = self._wire.handle(data)
        except Exception as fault:  # a wire at fault must not end the other instruments
            self._report.fault(self.name, fault)
            return
        self._send(answer, self._outbox.answer)

    def send_due(self) -> None:
        """Sends what became due; called once a tick. Also checks for a new client, which raises no event."""
        if not self.attached and not self.unplugged:
            self.receive()
        try:
            data = self._wire.due()
        except Exception as fault:  # see above
            self._report.fault(self.name, fault)
            return
        self._send(data, self._outbox.stream)

    @property
    def to_unplug(self) -> bool:
        """The wire wants the plug pulled that still is in."""
        return not self.unplugged and bool(getattr(self._wire, "closing", False))

    def unplug(self) -> None:
        """The client's end hangs up, and its name goes, as when a USB cable is pulled. Unwatch `fd` before."""
        self.close()
        self._outbox.clear()
        self.attached, self.unplugged = False, True

    def plug_when_due(self) -> None:
        """Back again, on a new terminal under the same link, once the wire wants that."""
        if not self.unplugged or getattr(self._wire, "closing", False):
            return
        self.fd, self.path = _open_terminal(self.name)
        self.unplugged = False
        if self._link is not None:
            make_link(self.name, self._link, self.path)

    def close(self) -> None:
        if self.unplugged:
            return
        if self._link is not None:
            remove_link(self._link, self.path)
        os.close(self.fd)

    def _send(self, data: bytes, offer: Callable[[bytes], object]) -> None:
        if not self.attached:
            return
        try:
            offer(data)
        except OSError:
            self._detach()

    def _detach(self) -> None:
        """The client has gone: what it left unread must not greet the next one.

        What came from clients is not flushed: the hang-up is reported after its last byte, so that anything there now
        is the next client's, who may have been quick.
        """
        if self.attached:
            self._outbox.clear()
            termios.tcflush(self.fd, termios.TCOFLUSH)
        self.attached = False


def _open_terminal(port_name: str) -> tuple[int, str]:
    """Master side, raw and not blocking, and the slave's path. The slave is closed, so that a hang-up can be seen."""
    try:
        master, slave = os.openpty()
    except OSError as error:
        raise HostError(
            f"{port_name}: no pseudo-terminal to be had: {error.strerror}; close programs that hold some"
        ) from error
    tty.setraw(slave)
    path = os.ttyname(slave)
    os.close(slave)
    os.set_blocking(master, False)
    return master, path
