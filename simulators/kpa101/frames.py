"""The unit's side of the APT protocol: requests that it reads, messages that it sends.

Six bytes of header, little endian: identifier; two parameters, or the number of data bytes; destination, with bit 7
when data follow; source. Source: Thorlabs, APT communications protocol, generic system and quad control messages.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

HOST, GENERIC_USB_UNIT = 0x01, 0x50
DATA_FOLLOWS = 0x80
HEADER_BYTES = 6
LONGEST_DATA = 64  # no request is longer; a longer one is noise


class Id(IntEnum):
    """Messages by name."""

    BLINK = 0x0223
    REQ_INFO = 0x0005
    GET_INFO = 0x0006
    START_UPDATES = 0x0011
    STOP_UPDATES = 0x0012
    RICH_RESPONSE = 0x0081
    QUAD_SET = 0x0870
    QUAD_REQ = 0x0871
    QUAD_GET = 0x0872
    REQ_STATUS = 0x0880
    GET_STATUS = 0x0881
    ACK_STATUS = 0x0882


@dataclass(frozen=True)
class Request:
    """A message for the unit; `data` is empty for a short one, whose parameters are `first` and `second`."""

    id: int
    first: int = 0
    second: int = 0
    data: bytes = b""


class RequestReader:
    """Collects bytes; what is not addressed to a USB unit by a host is skipped byte by byte."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[Request]:
        requests: list[Request] = []
        for byte in data:
            self._bytes.append(byte)
            request = self._front()
            if request is not None:
                requests.append(request)
        return requests

    def _front(self) -> Request | None:
        while len(self._bytes) >= HEADER_BYTES:
            number, length, destination, source = struct.unpack_from("<HHBB", self._bytes)
            long = bool(destination & DATA_FOLLOWS)
            if destination & ~DATA_FOLLOWS != GENERIC_USB_UNIT or source != HOST or (long and length > LONGEST_DATA):
                del self._bytes[0]
                continue
            end = HEADER_BYTES + (length if long else 0)
            if len(self._bytes) < end:
                return None
            data = bytes(self._bytes[HEADER_BYTES:end])
            del self._bytes[:end]
            return Request(number, data=data) if long else Request(number, length & 0xFF, length >> 8)
        return None


def message(number: Id, data: bytes) -> bytes:
    return struct.pack("<HHBB", number, len(data), HOST | DATA_FOLLOWS, GENERIC_USB_UNIT) + data


def info(serial_number: int, model: str, firmware: tuple[int, int, int]) -> bytes:
    """84 bytes: serial number, model, type, firmware (minor, interim, major), notes, versions, state, channels."""
    major, interim, minor = firmware
    head = struct.pack("<I8sHBBBx", serial_number, model.encode(), 16, minor, interim, major)
    notes = b"emulated".ljust(60, b"\0")
    return message(Id.GET_INFO, head + notes + struct.pack("<HHH", 1, 0, 1))


def part(number: int, body: bytes) -> bytes:
    """An answer to REQ of sub-message `number`."""
    return message(Id.QUAD_GET, struct.pack("<H", number) + body)


def refusal(request: int, code: int, words: str) -> bytes:
    return message(Id.RICH_RESPONSE, struct.pack("<HH64s", request, code, words.encode()[:63]))
