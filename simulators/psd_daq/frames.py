"""The box's side of the DAQ protocol: frames it sends, requests it reads (docs/protocols/psd-daq.md).

Consistent Overhead Byte Stuffing, written out: a frame without zeros, so that a zero can end it.

Source: S. Cheshire, M. Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Trans. Networking 7(2), 1999, section III.
"""

import binascii
import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

LONGEST_RUN = 254  # data bytes behind one code byte; code 0xFF stands for such a run without a zero after it

CODES = [bytes((length + 1,)) for length in range(LONGEST_RUN)]  # by the length of the run that follows


class StuffingError(ValueError):
    """Bytes that no encoder makes: a code byte points over the end."""


def stuff(content: bytes) -> bytes:
    """Encoded `content`, without the delimiter."""
    segments = content.split(b"\0")
    if max(map(len, segments)) < LONGEST_RUN:  # nearly every frame of this box
        return b"".join([part for segment in segments for part in (CODES[len(segment)], segment)])
    out = bytearray()
    for number, segment in enumerate(segments):
        last = number == len(segments) - 1
        while len(segment) >= LONGEST_RUN:
            out.append(LONGEST_RUN + 1)
            out += segment[:LONGEST_RUN]
            segment = segment[LONGEST_RUN:]
            if last and not segment:
                return bytes(out)  # the run ended with the content: no zero is implied
        out.append(len(segment) + 1)
        out += segment
    return bytes(out)


def unstuff(encoded: bytes) -> bytes:
    """Content of `encoded` (without the delimiter). StuffingError when it cannot be the work of an encoder."""
    out = bytearray()
    at = 0
    while at < len(encoded):
        code = encoded[at]
        end = at + code
        if code == 0 or end > len(encoded):
            raise StuffingError(f"code byte 0x{code:02X} at {at} of {len(encoded)} bytes")
        out += encoded[at + 1 : end]
        at = end
        if code <= LONGEST_RUN and at < len(encoded):
            out.append(0)
    return bytes(out)


VERSION = 1
LONGEST_REQUEST = 64  # encoded bytes; longer runs without a delimiter are noise


class Kind(IntEnum):
    """Message types."""

    IDENTIFY = 0x01
    START = 0x02
    STOP = 0x03
    PING = 0x04
    IDENTITY = 0x81
    ACK = 0x82
    NAK = 0x83
    DATA = 0x90


class Refusal(IntEnum):
    """Codes of a NAK."""

    UNKNOWN_REQUEST = 1
    WRONG_LENGTH = 2
    RATE_OUT_OF_RANGE = 3
    WRONG_VERSION = 4


@dataclass(frozen=True)
class Request:
    """A frame from the host whose CRC was right."""

    version: int
    kind: int
    body: bytes


class RequestReader:
    """Collects bytes until a delimiter; what does not pass its CRC is ignored, as the box has nobody to tell."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[Request]:
        requests: list[Request] = []
        for byte in data:
            if byte != 0:
                if len(self._bytes) <= LONGEST_REQUEST:
                    self._bytes.append(byte)
                continue
            request = _request(bytes(self._bytes))
            self._bytes.clear()
            if request is not None:
                requests.append(request)
        return requests


def _request(encoded: bytes) -> Request | None:
    try:
        content = unstuff(encoded)
    except StuffingError:
        return None
    if len(content) < 4 or checksum(content[:-2]) != int.from_bytes(content[-2:], "little"):
        return None
    return Request(content[0], content[1], content[2:-2])


def checksum(content: bytes) -> int:
    """CRC-16/CCITT-FALSE, which is what the C library's hqx CRC gives when it starts at all ones."""
    return binascii.crc_hqx(content, 0xFFFF)


def frame(kind: Kind, body: bytes) -> bytes:
    content = struct.pack("BB", VERSION, kind) + body
    return stuff(content + checksum(content).to_bytes(2, "little")) + b"\0"


def text(words: str) -> bytes:
    """Length byte and UTF-8, at most 64 bytes."""
    encoded = words.encode()[:64]
    return struct.pack("B", len(encoded)) + encoded


def ack(request: int) -> bytes:
    return frame(Kind.ACK, struct.pack("B", request))


def nak(request: int, code: Refusal, words: str) -> bytes:
    return frame(Kind.NAK, struct.pack("BB", request, code) + text(words))


def data(
    sequence: int,
    time_us: int,
    period_ns: int,
    temperature_degC: float,
    photocurrent_pa: NDArray[np.int32],
    flags: NDArray[np.uint16],
) -> bytes:
    """A frame of 1 to 32 samples, photocurrents (sample, 8), flags (sample,)."""
    count = len(flags)
    rows = np.zeros((count, 17), dtype="<u2")  # 8 x i32 and one u16, little endian
    rows[:, :16] = np.ascontiguousarray(photocurrent_pa.astype("<i4")).view("<u2")
    rows[:, 16] = flags
    centidegrees = max(-32768, min(32767, round(temperature_degC * 100.0)))
    head = struct.pack("<IQIBh", sequence % 2**32, time_us, period_ns, count, centidegrees)
    return frame(Kind.DATA, head + rows.tobytes())
