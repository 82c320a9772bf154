"""The messages between a KPA101 and a program, as records.

Source: Thorlabs, "APT communications protocol" (Host-Controller Communications Protocol, issue 37), sections on
generic system messages and on quad control messages; layouts cross-checked with two independent clients.
"""

from dataclasses import dataclass
from enum import IntEnum

FULL_COUNT = 32767  # of X, Y: 10 V
FULL_SUM_COUNT = 65535
FULL_SCALE_V = 10.0


class MessageId(IntEnum):
    """The first two bytes of every message."""

    IDENTIFY_BLINK = 0x0223
    DISCONNECT = 0x0002
    REQUEST_INFO = 0x0005
    INFO = 0x0006
    STOP_UPDATES = 0x0012
    FAULT = 0x0080
    RICH_FAULT = 0x0081
    QUAD_SET = 0x0870
    QUAD_REQUEST = 0x0871
    QUAD = 0x0872
    STATUS = 0x0881


class QuadPart(IntEnum):
    """Sub-message of the QUAD messages."""

    READINGS = 3
    MODE = 7


class Mode(IntEnum):
    """What the unit does with its outputs."""

    MONITOR = 1
    OPEN_LOOP = 2
    CLOSED_LOOP = 3
    AUTO = 4


@dataclass(frozen=True)
class RequestInfo:
    """Who are you? Answered by Info."""


@dataclass(frozen=True)
class RequestReadings:
    """Answered by Readings."""


@dataclass(frozen=True)
class RequestMode:
    """Answered by ModeIs."""


@dataclass(frozen=True)
class SetMode:
    """No answer: ask for the mode afterwards."""

    mode: Mode


@dataclass(frozen=True)
class StopUpdates:
    """No more Status ten times a second, which another program may have asked for. No answer."""


@dataclass(frozen=True)
class Info:
    """What the unit is."""

    serial_number: int
    model: str
    firmware: str
    hardware_version: int


@dataclass(frozen=True)
class Readings:
    """Counts as sent: differences and outputs -32768 to 32767, sum 0 to 65535."""

    x: int
    y: int
    sum: int
    x_out: int
    y_out: int


@dataclass(frozen=True)
class ModeIs:
    """`mode` is a Mode, or a number that a later firmware added."""

    mode: int


@dataclass(frozen=True)
class Status:
    """Readings sent without being asked."""

    readings: Readings
    bits: int


@dataclass(frozen=True)
class Fault:
    """The unit could not do what it was sent; `text` is empty when it gives none."""

    message: int
    code: int
    text: str


@dataclass(frozen=True)
class Other:
    """A message of the family that this program has no use for."""

    id: int


@dataclass(frozen=True)
class StrayBytes:
    """Bytes that begin no message: where in the stream, how many, and the first 32 of them."""

    offset: int
    count: int
    first: bytes


Request = RequestInfo | RequestReadings | RequestMode | SetMode | StopUpdates
Message = Info | Readings | ModeIs | Status | Fault | Other | StrayBytes
