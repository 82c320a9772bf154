"""The PSD DAQ protocol, bytes to messages and requests to bytes, without I/O (docs/protocols/psd-daq.md).

No length field is trusted: a frame ends at its 0x00, must pass its CRC and then fit its layout to the byte; a run of
more than MAX_FRAME bytes without 0x00 is dropped. So the first whole frame after any damage is read again.

The messages of samples become a block in SI units: their 32-bit sequence number wraps and starts again, that of a block
only rises.
"""

import binascii
import struct
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from cobs import cobs

from drivers.device import Block
from drivers.psd_daq.messages import (
    PROTOCOL_VERSION,
    Ack,
    BadFrame,
    FaceIdentity,
    Identify,
    Identity,
    Message,
    MessageType,
    Nak,
    Request,
    Samples,
    StartStream,
    StopStream,
)
from drivers.psd_faces import FaceKind

WRAP = 1 << 32
MAX_SAMPLES = 32
MAX_FRAME = 1200  # encoded bytes; 32 samples make 1117, see the table of sizes in the protocol document
CRC_SEED = 0xFFFF  # CRC-16/CCITT-FALSE: polynomial 0x1021, not reflected, no final xor (catalogue of CRCs, G. Cook)
IDENTITY_HEAD = struct.Struct("<BBBIIBIBIHH")
DATA_HEAD = struct.Struct("<IQIBh")
SAMPLE = np.dtype([("photocurrent_pa", "<i4", 8), ("flags", "<u2")])


class _LayoutError(Exception):
    """A frame whose CRC is right and whose content is not; becomes a BadFrame."""


class PsdDaqCodec:
    """One line's decoder; `encode` needs no state but stands here so that a codec is one object."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._offset = 0  # of the first byte in the buffer, in the stream
        self._skipping = False  # over the rest of a run that was too long

    def feed(self, data: bytes) -> list[Message]:
        """Messages that `data`, any part of the stream, completes; damage comes as BadFrame, never as an exception."""
        messages: list[Message] = []
        *complete, rest = data.split(b"\0")
        for part in complete:
            self._buffer += part
            self._end_frame(messages)
        self._buffer += rest
        if len(self._buffer) > MAX_FRAME:
            self._drop_run(messages)
        return messages

    def encode(self, request: Request) -> bytes:
        """The frame of a request. ValueError for a rate that does not fit its field."""
        match request:
            case Identify():
                return frame(MessageType.IDENTIFY)
            case StartStream(rate_hz):
                if not 0 <= rate_hz <= 0xFFFF:
                    raise ValueError(f"rate {rate_hz} Hz does not fit 16 bits")
                return frame(MessageType.START_STREAM, struct.pack("<H", rate_hz))
            case StopStream():
                return frame(MessageType.STOP_STREAM)

    def _end_frame(self, messages: list[Message]) -> None:
        encoded, offset = bytes(self._buffer), self._offset
        self._offset += len(encoded) + 1
        self._buffer.clear()
        if self._skipping:
            self._skipping = False
        elif len(encoded) > MAX_FRAME:
            messages.append(_too_long(offset, encoded))
        elif encoded:
            messages.append(_decode(encoded, offset))

    def _drop_run(self, messages: list[Message]) -> None:
        if not self._skipping:
            messages.append(_too_long(self._offset, bytes(self._buffer)))
        self._skipping = True
        self._offset += len(self._buffer)
        self._buffer.clear()


def frame(kind: int, body: bytes = b"", version: int = PROTOCOL_VERSION) -> bytes:
    """Header, body and CRC, stuffed and closed with the delimiter."""
    content = bytes((version, kind)) + body
    return cobs.encode(content + struct.pack("<H", binascii.crc_hqx(content, CRC_SEED))) + b"\0"


def _too_long(offset: int, encoded: bytes) -> BadFrame:
    return BadFrame(offset, f"more than {MAX_FRAME} bytes without a delimiter", encoded[:32])


def _decode(encoded: bytes, offset: int) -> Message:
    try:
        return _parse(_checked(encoded))
    except (cobs.DecodeError, _LayoutError) as cause:
        return BadFrame(offset, str(cause), encoded[:32])


def _checked(encoded: bytes) -> bytes:
    content = cobs.decode(encoded)
    if len(content) < 4:
        raise _LayoutError(f"frame of {len(content)} bytes; the shortest has 4")
    (stated,) = struct.unpack("<H", content[-2:])
    computed = binascii.crc_hqx(content[:-2], CRC_SEED)
    if stated != computed:
        raise _LayoutError(f"CRC 0x{stated:04X}, computed 0x{computed:04X}")
    return content[:-2]


def _parse(content: bytes) -> Message:
    version, kind = content[0], content[1]
    if version != PROTOCOL_VERSION:
        raise _LayoutError(f"protocol version {version}, expected {PROTOCOL_VERSION}")
    if kind not in _BODIES:
        raise _LayoutError(f"message type 0x{kind:02X} is not one that a box sends")
    try:
        return _BODIES[kind](content[2:])
    except (struct.error, IndexError, UnicodeDecodeError, ValueError) as cause:
        raise _LayoutError(f"message type 0x{kind:02X}: {cause}") from cause


def _identity(body: bytes) -> Identity:
    major, minor, patch, full_pa, transimpedance, kind1, um1, kind2, um2, low, high = IDENTITY_HEAD.unpack_from(body)
    serial_number, after = _text(body, IDENTITY_HEAD.size)
    model, end = _text(body, after)
    _ends(body, end)
    faces = (FaceIdentity(FaceKind(kind1), um1 * 1e-6), FaceIdentity(FaceKind(kind2), um2 * 1e-6))
    firmware = f"{major}.{minor}.{patch}"
    return Identity(firmware, serial_number, model, full_pa * 1e-12, float(transimpedance), faces, low, high)


def _ack(body: bytes) -> Ack:
    _ends(body, 1)
    return Ack(body[0])


def _nak(body: bytes) -> Nak:
    text, end = _text(body, 2)
    _ends(body, end)
    return Nak(body[0], body[1], text)


def _samples(body: bytes) -> Samples:
    sequence, time_us, period_ns, count, centidegrees = DATA_HEAD.unpack_from(body)
    if not 1 <= count <= MAX_SAMPLES:
        raise _LayoutError(f"{count} samples in one frame; 1 to {MAX_SAMPLES} are allowed")
    _ends(body, DATA_HEAD.size + count * SAMPLE.itemsize)
    rows = np.frombuffer(body, SAMPLE, count, DATA_HEAD.size)
    return Samples(sequence, time_us, period_ns, centidegrees * 0.01, rows["photocurrent_pa"], rows["flags"])


def _text(body: bytes, at: int) -> tuple[str, int]:
    """Text behind its length byte, and where it ends."""
    end = at + 1 + body[at]
    if end > len(body):
        raise _LayoutError(f"text of {body[at]} bytes runs over the end of the frame")
    return body[at + 1 : end].decode(), end


def _ends(body: bytes, end: int) -> None:
    if len(body) != end:
        raise _LayoutError(f"body of {len(body)} bytes, expected {end}")


_BODIES: Mapping[int, Callable[[bytes], Message]] = {
    MessageType.IDENTITY: _identity,
    MessageType.ACK: _ack,
    MessageType.NAK: _nak,
    MessageType.DATA: _samples,
}


class SequenceCount:
    """Unwraps the box's count. After `restart` (a new stream) the count goes on behind a gap of at least one sample."""

    def __init__(self) -> None:
        self._next = 0  # rising number of the next sample, when none is lost
        self._shift = 0  # rising minus raw number, of the present stream

    def restart(self) -> None:
        """The box counts from zero again; whatever it sends next is behind all that was before."""
        if self._next > 0:
            self._next += 1  # what passed between the streams is not known to be nothing
        self._shift = self._next

    def unwrap(self, raw: int, count: int) -> int:
        """The rising number of a frame's first sample, `count` samples long."""
        while raw + self._shift < self._next - WRAP // 2:
            self._shift += WRAP
        rising = raw + self._shift
        self._next = rising + count
        return rising


class RepeatFilter:
    """Finds frames of one stream that came before: their samples must not count twice."""

    def __init__(self) -> None:
        self._next: int | None = None

    def is_new(self, raw: int, count: int) -> bool:
        """Whether the frame with this first sample, `count` samples long, begins behind all that were new."""
        if self._next is not None and (raw - self._next) % WRAP >= WRAP // 2:
            return False
        self._next = (raw + count) % WRAP
        return True


def to_block(arrived: Sequence[tuple[float, Samples]], count: SequenceCount) -> Block:
    """One block of all `arrived` (host time of arrival, samples), at least one, in the order they came."""
    counts = [len(samples.flags) for _, samples in arrived]
    values = {
        "photocurrent_a": np.concatenate([samples.photocurrent_pa for _, samples in arrived]) * 1e-12,
        "flags": np.concatenate([samples.flags for _, samples in arrived]).astype(np.uint16),
        "temperature_degC": np.repeat([samples.temperature_degC for _, samples in arrived], counts),
    }
    starts = np.repeat([samples.time_us * 1e-6 for _, samples in arrived], counts)
    periods = np.repeat([samples.period_ns * 1e-9 for _, samples in arrived], counts)
    firsts = [count.unwrap(samples.sequence, len(samples.flags)) for _, samples in arrived]
    within = np.concatenate([np.arange(n) for n in counts])
    return Block(
        host_s=np.repeat([host_s for host_s, _ in arrived], counts).astype(np.float64),
        device_s=(starts + within * periods).astype(np.float64),
        sequence=np.repeat(np.array(firsts, dtype=np.int64), counts) + within,
        values=MappingProxyType(values),
    )
