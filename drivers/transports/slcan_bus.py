"""python-can's serial-line adapter, but reading all that waits at once.

`can.interfaces.slcan` asks the operating system for every single byte: 22 calls a frame, so that six encoders at 500 Hz
fill a core and answers are seen a millisecond late. And pyserial's reading and writing ask it twice more for each piece
than is needed. Parsing and opening stay python-can's, and what a port does not take at once is left to pyserial.
"""

import os
import re
import select
import time
from collections import deque
from contextlib import suppress
from functools import lru_cache
from typing import Any

import can
from can.exceptions import error_check
from can.interfaces.slcan import slcanBus

_ACKNOWLEDGED = ("", "z", "Z")  # LAWICEL CANUSB manual, version 1.0D: command done, frame taken
_HEAD = re.compile(r"t([0-9A-Fa-f]{3})([0-8])")
READ_BYTES = 4096  # what a port holds back
NO_STAMP = 0.0  # none was asked for (slcan_stamps does); python-can puts the time of this program there
LONGEST_LINE = 256  # a frame of CAN FD takes 139; a line without an end is junk, and may not fill the memory


class BlockSlcanBus(slcanBus):
    """A drop-in for `slcanBus`. Where the port has no file descriptor (Windows) it waits in steps of the port."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        self._lines: deque[str] = deque()
        self._begun = ""  # a line whose end has not come yet
        try:
            super().__init__(*arguments, **settings)
        except BaseException:
            self._give_up()
            raise

    def _give_up(self) -> None:
        """An adapter that went while it was being opened: python-can leaves the port open, and a bus that complains."""
        self._is_shutdown = True
        port = getattr(self, "serialPortOrig", None)
        if port is not None:
            with suppress(OSError):
                port.close()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """As python-can's; a plain frame that waits is handed out without its detours."""
        if not self._lines:
            self._fill(timeout)
        if not self._lines:
            return None
        message = None if self._filters else classic_frame(self._lines[0])
        if message is not None:
            self._lines.popleft()
            return message
        message = super().recv(timeout)  # a rarer kind, or junk: python-can's own parser decides
        if message is not None:
            message.timestamp = NO_STAMP
        return message

    def recv_all(self, timeout: float | None = None) -> list[can.Message]:
        """All plain frames that are there, waiting for the first; or one of a rarer kind."""
        if not self._lines:
            self._fill(timeout)
        messages: list[can.Message] = []
        while self._lines and not self._filters and (message := classic_frame(self._lines[0])) is not None:
            self._lines.popleft()
            messages.append(message)
        if not messages and self._lines and (rare := self.recv(0.0)) is not None:
            messages.append(rare)
        return messages

    def flush(self) -> None:
        super().flush()
        self._lines.clear()
        self._begun = ""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """As python-can's; a plain frame is written without its detours."""
        if msg.is_extended_id or msg.is_remote_frame or msg.is_fd:
            super().send(msg, timeout)
        else:
            self._put(b"t%03X%d%s\r" % (msg.arbitration_id, msg.dlc, msg.data.hex().upper().encode()), timeout)

    def _read(self, timeout: float | None) -> str | None:
        """A line with its end, as python-can wants it."""
        self._fill(timeout)
        return f"{self._lines.popleft()}\r" if self._lines else None

    def _fill(self, timeout: float | None) -> None:
        """Wait for a whole line, unless one is there."""
        left_s = timeout
        deadline_s = time.monotonic() + timeout if timeout else None
        while not self._lines:
            try:
                self._split(self._waiting(left_s))
            except Exception as error:
                raise can.CanOperationError("Could not read from serial device") from error
            if left_s == 0.0:
                return
            if deadline_s is not None:
                left_s = max(0.0, deadline_s - time.monotonic())

    def _waiting(self, timeout_s: float | None) -> bytes:
        """All bytes that are there, waiting for the first; b"" when none came in time."""
        port = self.serialPortOrig
        descriptor = self._descriptor()
        if descriptor is None:
            return bytes(port.read(port.in_waiting or 1))
        if timeout_s == 0.0 and (data := _read(descriptor)):  # who does not wait mostly comes when something is there
            return data
        if not select.select([descriptor], [], [], timeout_s)[0]:
            return b""
        data = _read(descriptor)
        if data is None:  # somebody else has read it
            return b""
        if not data:
            raise OSError("the port is ready and gives nothing: unplugged")
        return data

    def _write(self, string: str) -> None:
        self._put(string.encode() + self.LINE_TERMINATOR, self.serialPortOrig.write_timeout)

    def _put(self, line: bytes, timeout: float | None) -> None:
        """Without waiting until the last bit has left, which does not show whether the adapter could send it."""
        try:
            descriptor = self._descriptor()
            taken = 0 if descriptor is None else os.write(descriptor, line)
        except BlockingIOError:
            taken = 0
        except OSError as error:
            raise can.CanOperationError("Could not write to serial device") from error
        if taken < len(line):
            self._put_rest(line[taken:], timeout)

    def _put_rest(self, rest: bytes, timeout: float | None) -> None:
        port = self.serialPortOrig
        with error_check("Could not write to serial device"):
            if port.write_timeout != timeout:
                port.write_timeout = timeout
            port.write(rest)

    def _descriptor(self) -> int | None:
        """None where a port has none, or is closed."""
        try:
            return int(self.serialPortOrig.fileno())
        except (OSError, AttributeError):  # io.UnsupportedOperation is an OSError
            return None

    def _split(self, data: bytes) -> None:
        """Whole lines to `_lines`; nobody waits for acknowledgements and refusals."""
        *lines, begun = (self._begun + data.decode("latin-1")).replace("\a", "\r").split("\r")
        self._lines.extend([line for line in lines if line not in _ACKNOWLEDGED])
        self._begun = begun[:LONGEST_LINE]


def _read(descriptor: int) -> bytes | None:
    """What waits; None when nothing does, b"" then also with some drivers, and when the port has gone."""
    try:
        return os.read(descriptor, READ_BYTES)
    except BlockingIOError:
        return None


def classic_frame(line: str) -> can.Message | None:
    """A data frame with an identifier of 11 bits, "tIIILDD..", which nearly all are; None for all else."""
    head = _head(line[:5])
    if head is None or len(line) != 5 + 2 * head[1]:
        return None
    try:
        data = bytearray.fromhex(line[5:])
    except ValueError:
        return None
    if len(data) != head[1]:  # it skips blanks
        return None
    return can.Message(NO_STAMP, head[0], False, False, False, None, head[1], data)


@lru_cache(maxsize=4096)  # a bus has few different ones
def _head(text: str) -> tuple[int, int] | None:
    """Identifier and length; None when it begins no plain frame."""
    found = _HEAD.fullmatch(text)
    return None if found is None else (int(found[1], 16), int(found[2]))
