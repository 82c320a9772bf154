"""The APT protocol of the KPA101, bytes to messages and requests to bytes, without I/O (docs/protocols/kpa101.md).

APT has no checksum and no delimiter. So a message is taken only when its whole header is one that this unit sends -
identifier, exact length, both addresses, sub-message - and no other such header begins inside it: a message that was
cut short is left out, and the next one is read. When the last bytes of a message could be the beginning of the next
header it waits for more bytes, or for `settle`, which the reader calls when the line has fallen quiet. No length field
is trusted: a length that the table does not know begins no message, so nothing longer than 90 bytes is ever kept.
"""

import struct
from collections.abc import Callable, Mapping

from drivers.psd_kpa101.messages import (
    Fault,
    Info,
    Message,
    MessageId,
    Mode,
    ModeIs,
    Other,
    QuadPart,
    Readings,
    Request,
    RequestInfo,
    RequestMode,
    RequestReadings,
    SetMode,
    Status,
    StopUpdates,
    StrayBytes,
)

HOST, UNIT, WITH_DATA = 0x01, 0x50, 0x80
HEADER = 6
SHORT = struct.Struct("<HBBBB")  # id, two parameters, destination, source
LONG = struct.Struct("<HHBB")  # id, bytes of data, destination with WITH_DATA, source
READINGS = struct.Struct("<hhHhh")
LONGEST = 90

# Beginnings of all that the unit sends, with the length of the whole. A sub-message that we never ask for is listed
# too, because another program may have left its answer on the line.
_QUAD_BYTES = {1: 8, 3: 12, 5: 18, 7: 4, 8: 8, 0x0A: 4, 0x0B: 4, 0x0C: 6, 0x0D: 6, 0x0F: 14}


def _long(message: int, data_bytes: int, begins: bytes = b"") -> tuple[bytes, int]:
    return LONG.pack(message, data_bytes, HOST | WITH_DATA, UNIT) + begins, HEADER + data_bytes


_HEADS: tuple[tuple[bytes, int], ...] = (
    _long(MessageId.INFO, 84),
    _long(MessageId.STATUS, 14),
    _long(MessageId.RICH_FAULT, 68),
    *(_long(MessageId.QUAD, size, struct.pack("<H", part)) for part, size in _QUAD_BYTES.items()),
    (SHORT.pack(MessageId.FAULT, 0, 0, HOST, UNIT), HEADER),
    (SHORT.pack(MessageId.DISCONNECT, 0, 0, HOST, UNIT), HEADER),
)
_FIRST_BYTES = frozenset(head[0] for head, _ in _HEADS)


class Kpa101Codec:
    """One line's decoder; `encode` needs no state but stands here so that a codec is one object."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._offset = 0  # of the first byte in the buffer, in the stream
        self._junk = bytearray()  # the first 32 bytes of the run of junk just before the buffer
        self._junk_count = 0

    @property
    def undecided(self) -> bool:
        """Bytes wait for their continuation."""
        return bool(self._buffer)

    def feed(self, data: bytes) -> list[Message]:
        """Messages that `data`, any part of the stream, completes; damage comes as Junk, never as an exception."""
        messages: list[Message] = []
        for begin in range(0, len(data), LONGEST):  # in pieces: what is kept stays short whatever comes at once
            self._buffer += data[begin : begin + LONGEST]
            self._take(messages, quiet=False)
        return messages

    def settle(self) -> list[Message]:
        """The line has fallen quiet: what is whole is a message, what is not never will be."""
        messages: list[Message] = []
        self._take(messages, quiet=True)
        while self._buffer:
            self._skip(1)
            self._take(messages, quiet=True)
        self._end_junk(messages)
        return messages

    def encode(self, request: Request) -> bytes:
        match request:
            case RequestInfo():
                return SHORT.pack(MessageId.REQUEST_INFO, 0, 0, UNIT, HOST)
            case RequestReadings():
                return SHORT.pack(MessageId.QUAD_REQUEST, QuadPart.READINGS, 0, UNIT, HOST)
            case RequestMode():
                return SHORT.pack(MessageId.QUAD_REQUEST, QuadPart.MODE, 0, UNIT, HOST)
            case SetMode(mode):
                return LONG.pack(MessageId.QUAD_SET, 4, UNIT | WITH_DATA, HOST) + struct.pack(
                    "<HH", QuadPart.MODE, Mode(mode)
                )
            case StopUpdates():
                return SHORT.pack(MessageId.STOP_UPDATES, 0, 0, UNIT, HOST)

    def _take(self, messages: list[Message], *, quiet: bool) -> None:
        """Everything at the front of the buffer that is decided."""
        while self._buffer:
            size = _size(self._buffer, quiet=quiet)
            if size is None:
                return
            if size == 0:
                self._skip(1)
                continue
            inner = _inner_head(self._buffer, min(size, len(self._buffer)))
            if inner and _whole_head(self._buffer, inner):
                self._skip(inner)  # this message was cut short by the next
                continue
            if size > len(self._buffer) or (inner and not quiet):
                return  # more bytes decide whether it is whole, or the next message begins inside it
            self._end_junk(messages)
            messages.append(_parse(bytes(self._buffer[:size])))
            self._drop(size)

    def _skip(self, count: int) -> None:
        self._junk += self._buffer[: min(count, 32 - len(self._junk))]
        self._junk_count += count
        self._drop(count)

    def _drop(self, count: int) -> None:
        del self._buffer[:count]
        self._offset += count

    def _end_junk(self, messages: list[Message]) -> None:
        if self._junk_count:
            messages.append(StrayBytes(self._offset - self._junk_count, self._junk_count, bytes(self._junk)))
        self._junk.clear()
        self._junk_count = 0


def _size(buffer: bytearray, *, quiet: bool) -> int | None:
    """Bytes of the message at the front; 0 when none begins here, None when more bytes are needed to decide."""
    front = bytes(buffer[: HEADER + 2])
    undecided = False
    for head, size in _HEADS:
        if front.startswith(head):
            return size
        undecided = undecided or head.startswith(front)
    return None if undecided and not quiet else 0


def _inner_head(buffer: bytearray, size: int) -> int:
    """Where, inside the message at the front, another header begins or may begin; 0 when nowhere."""
    for begin in range(1, size):
        if buffer[begin] in _FIRST_BYTES:
            rest = bytes(buffer[begin : begin + HEADER + 2])
            if any(rest.startswith(head) or head.startswith(rest) for head, _ in _HEADS):
                return begin
    return 0


def _whole_head(buffer: bytearray, begin: int) -> bool:
    rest = bytes(buffer[begin : begin + HEADER + 2])
    return any(rest.startswith(head) for head, _ in _HEADS)


def _parse(message: bytes) -> Message:
    """A message whose length the table has checked."""
    number = int.from_bytes(message[:2], "little")
    data = message[HEADER:]
    known = _PARSERS.get(number)
    return Other(number) if known is None else known(data)


def _info(data: bytes) -> Info:
    serial_number, model = struct.unpack_from("<I8s", data)
    minor, interim, major = data[14:17]
    (hardware_version,) = struct.unpack_from("<H", data, 78)
    return Info(serial_number, _words(model), f"{major}.{interim}.{minor}", hardware_version)


def _quad(data: bytes) -> Message:
    (part,) = struct.unpack_from("<H", data)
    if part == QuadPart.READINGS:
        return Readings(*READINGS.unpack_from(data, 2))
    if part == QuadPart.MODE:
        return ModeIs(int.from_bytes(data[2:4], "little"))
    return Other(MessageId.QUAD)


def _status(data: bytes) -> Status:
    (bits,) = struct.unpack_from("<I", data, READINGS.size)
    return Status(Readings(*READINGS.unpack_from(data)), bits)


def _rich_fault(data: bytes) -> Fault:
    message, code = struct.unpack_from("<HH", data)
    return Fault(message, code, _words(data[4:68]))


def _words(text: bytes) -> str:
    """Up to the first zero; what is no ASCII shows as a question mark."""
    return text.split(b"\0")[0].decode("ascii", "replace").replace("�", "?").strip()


_PARSERS: Mapping[int, Callable[[bytes], Message]] = {
    MessageId.INFO: _info,
    MessageId.QUAD: _quad,
    MessageId.STATUS: _status,
    MessageId.RICH_FAULT: _rich_fault,
    MessageId.FAULT: lambda data: Fault(0, 0, ""),
}
