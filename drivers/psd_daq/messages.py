"""The messages on the line to a PSD DAQ box, as records: docs/protocols/psd-daq.md in Python."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from drivers.psd_faces import FaceKind

PROTOCOL_VERSION = 1
MIN_RATE_HZ, MAX_RATE_HZ = 100, 4000  # what any box of this protocol can do; each states its own in IDENTITY


class MessageType(IntEnum):
    """The second byte of every frame; above 0x80 the box speaks."""

    IDENTIFY = 0x01
    START_STREAM = 0x02
    STOP_STREAM = 0x03
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


class Flag(IntEnum):
    """Bits of a sample's flags."""

    PSD1_SATURATED = 0x0001
    PSD2_SATURATED = 0x0002
    PSD1_NO_LIGHT = 0x0004
    PSD2_NO_LIGHT = 0x0008


@dataclass(frozen=True)
class Identify:
    """Who are you? Answered by Identity."""


@dataclass(frozen=True)
class StartStream:
    """Sample at `rate_hz`, whole hertz. Answered by Ack or Nak, then Samples until StopStream."""

    rate_hz: int


@dataclass(frozen=True)
class StopStream:
    """Sample no more. Answered by Ack."""


@dataclass(frozen=True)
class FaceIdentity:
    """One detector as the box knows it."""

    kind: FaceKind
    length_m: float  # electrode to electrode


@dataclass(frozen=True)
class Identity:
    """What the box is."""

    firmware: str  # "1.0.3"
    serial_number: str
    model: str
    full_scale_a: float
    transimpedance_v_a: float
    faces: tuple[FaceIdentity, FaceIdentity]
    min_rate_hz: int
    max_rate_hz: int


@dataclass(frozen=True)
class Ack:
    """The request of that type is done."""

    request: int


@dataclass(frozen=True)
class Nak:
    """`code` is a Refusal, or a number that a later firmware added."""

    request: int
    code: int
    text: str


@dataclass(frozen=True)
class Samples:
    """Consecutive samples; sample i was taken at `time_us` 1e-6 + i `period_ns` 1e-9 s of the box's clock."""

    sequence: int  # of the first sample; wraps at 2**32
    time_us: int
    period_ns: int
    temperature_degC: float
    photocurrent_pa: NDArray[np.int32]  # (sample, 8): psd1 x1, x2, y1, y2, psd2 x1, x2, y1, y2
    flags: NDArray[np.uint16]  # (sample,)


@dataclass(frozen=True)
class BadFrame:
    """Bytes that are no message: where in the stream they began, why, and the first 32 of them."""

    offset: int
    reason: str
    first: bytes


Request = Identify | StartStream | StopStream
Message = Identity | Ack | Nak | Samples | BadFrame
