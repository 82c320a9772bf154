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
from typing import Any

import can
from can.exceptions import error_check
from can.interfaces.slcan import slcanBus

_ACKNOWLEDGED = ("\r", "z\r", "Z\r")  # LAWICEL CANUSB manual, version 1.0D: command done, frame taken
_LINE = re.compile(r"[^\r\a]*[\r\a]")
_CLASSIC = re.compile(r"t([0-9A-Fa-f]{3})([0-8])([0-9A-Fa-f]*)\r")
READ_BYTES = 4096  # what a port holds back
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
        message = None if self._filters else _classic(self._lines[0])
        if message is None:  # a rarer kind, or junk: python-can's own parser decides
            return super().recv(timeout)
        self._lines.popleft()
        return message

    def flush(self) -> None:
        super().flush()
        self._lines.clear()
        self._begun = ""

    def _read(self, timeout: float | None) -> str | None:
        self._fill(timeout)
        return self._lines.popleft() if self._lines else None

    def _fill(self, timeout: float | None) -> None:
        """Wait for a whole line, unless one is there."""
        deadline_s = None if timeout is None else time.monotonic() + timeout
        while not self._lines:
            left_s = None if deadline_s is None else max(0.0, deadline_s - time.monotonic())
            with error_check("Could not read from serial device"):
                self._split(self._waiting(left_s))
            if left_s == 0.0:
                return

    def _waiting(self, timeout_s: float | None) -> bytes:
        """All bytes that are there, waiting for the first; b"" when none came in time."""
        port = self.serialPortOrig
        descriptor = self._descriptor()
        if descriptor is None:
            return bytes(port.read(port.in_waiting or 1))
        if not select.select([descriptor], [], [], timeout_s)[0]:
            return b""
        try:
            data = os.read(descriptor, READ_BYTES)
        except BlockingIOError:  # somebody else has read it
            return b""
        if not data:
            raise OSError("the port is ready and gives nothing: unplugged")
        return data

    def _write(self, string: str) -> None:
        """Without waiting until the last bit has left, which says nothing of whether the adapter could send it."""
        line = string.encode() + self.LINE_TERMINATOR
        with error_check("Could not write to serial device"):
            descriptor = self._descriptor()
            taken = 0
            if descriptor is not None:
                with suppress(BlockingIOError):
                    taken = os.write(descriptor, line)
            if taken < len(line):
                self.serialPortOrig.write(line[taken:])

    def _descriptor(self) -> int | None:
        """None where a port has none, or is closed."""
        try:
            return int(self.serialPortOrig.fileno())
        except (OSError, AttributeError):  # io.UnsupportedOperation is an OSError
            return None

    def _split(self, data: bytes) -> None:
        """Whole lines, with their ends, to `_lines`; acknowledgements say nothing that anybody waits for."""
        text = self._begun + data.decode("latin-1")
        end = 0
        for found in _LINE.finditer(text):
            end = found.end()
            if found[0] not in _ACKNOWLEDGED:
                self._lines.append(found[0])
        self._begun = text[end : end + LONGEST_LINE]


def _classic(line: str) -> can.Message | None:
    """A data frame with an identifier of 11 bits, "tIIILDD..", which nearly all are; None for all else."""
    found = _CLASSIC.fullmatch(line)
    if found is None or len(found[3]) != 2 * int(found[2]):
        return None
    data = bytes.fromhex(found[3])
    return can.Message(time.time(), int(found[1], 16), False, dlc=len(data), data=data)
