"""The box's side of the DAQ protocol (docs/protocols/psd-daq.md): frames it sends, requests it reads, its serial line.

Consistent Overhead Byte Stuffing is written out: a frame without zeros, so that a zero can end it. Source: S. Cheshire,
M. Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Trans. Networking 7(2), 1999, section III. The line has the time
that bytes take, and a transmit buffer that can overflow.
"""

import binascii
import struct
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Generic, TypeVar

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
        if code == 0 or end > len(encoded) or 0 in encoded[at + 1 : end]:
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
    """Collects bytes until a delimiter; what does not pass its CRC is ignored, as the box has nobody to inform."""

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


BITS_PER_BYTE = 10  # start bit, 8 data bits, stop bit
DEFAULT_BAUD = 3_000_000
BUFFER_BYTES = 4096  # as a small microcontroller has; 11 ms at 3 Mbaud


class TransmitLine:
    """Frames leave one after the other: each ends not before the previous one did, plus its own bytes' time."""

    def __init__(self, baud: int = DEFAULT_BAUD) -> None:
        self._byte_s = BITS_PER_BYTE / baud
        self._queue: deque[tuple[float, bytes]] = deque()
        self._free_s = 0.0  # when the last queued frame has left
        self.dropped = 0  # frames that found the buffer full

    def send(self, frame: bytes, ready_s: float) -> None:
        """Queue a frame that is ready at `ready_s`; dropped whole when the buffer has no room for it."""
        waiting = (self._free_s - ready_s) / self._byte_s
        if waiting + len(frame) > BUFFER_BYTES:
            self.dropped += 1
            return
        self._free_s = max(self._free_s, ready_s) + len(frame) * self._byte_s
        self._queue.append((self._free_s, frame))

    def delivered(self, now_s: float) -> bytes:
        """What has fully left by `now_s` and was not fetched yet."""
        out = bytearray()
        while self._queue and self._queue[0][0] <= now_s:
            out += self._queue.popleft()[1]
        return bytes(out)

    def clear(self) -> None:
        self._queue.clear()


AnyRequest = TypeVar("AnyRequest")


class RequestWire(Generic[AnyRequest]):
    """One connection: what `read` makes of the bytes is obeyed in order, and the answers leave on the device's line."""

    def __init__(
        self,
        read: Callable[[bytes], Sequence[AnyRequest]],
        obey: Callable[[AnyRequest], None],
        line: TransmitLine,
        now_s: Callable[[], float],
    ) -> None:
        self._read, self._obey, self._line, self._now_s = read, obey, line, now_s

    def handle(self, data: bytes) -> bytes:
        for request in self._read(data):
            self._obey(request)
        return self.due()

    def due(self) -> bytes:
        return self._line.delivered(self._now_s())
