"""RTDE, the client's side: bytes to messages and back, no I/O.

A run of data packages of one recipe is decoded in one go with a structured numpy type, because at several thousand
packages a second a Python loop over them would cost more than everything else. Never allocates by a length that the
wire names: at most one frame of 65535 bytes is held back. RTDE has nothing to find the next frame by after a wrong
length, and TCP damages none on the way: a length that its kind of frame cannot have ends the stream at once.
Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", protocol versions 1 and 2.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEADER = struct.Struct(">HB")  # size of the whole frame with these three bytes, type
PROTOCOL_VERSION = 2
HEAD_SHOWN = 32  # bytes of rubbish that an error message shows

DTYPES: dict[str, tuple[str, tuple[int, ...]]] = {
    "BOOL": ("?", ()),
    "UINT8": ("u1", ()),
    "UINT32": (">u4", ()),
    "UINT64": (">u8", ()),
    "INT32": (">i4", ()),
    "DOUBLE": (">f8", ()),
    "VECTOR3D": (">f8", (3,)),
    "VECTOR6D": (">f8", (6,)),
    "VECTOR6INT32": (">i4", (6,)),
    "VECTOR6UINT32": (">u4", (6,)),
}


class Kind(IntEnum):
    """Frame types: ASCII letters."""

    PROTOCOL_VERSION = 86  # V
    CONTROLLER_VERSION = 118  # v
    TEXT = 77  # M
    DATA = 85  # U
    OUTPUTS = 79  # O
    INPUTS = 73  # I
    START = 83  # S
    PAUSE = 80  # P


LONGEST = {  # bytes of a whole frame
    Kind.PROTOCOL_VERSION: 4,
    Kind.CONTROLLER_VERSION: 19,
    Kind.TEXT: 516,  # two texts of at most 255 bytes, their lengths, and a level
    Kind.DATA: 65535,
    Kind.OUTPUTS: 65535,
    Kind.INPUTS: 65535,
    Kind.START: 4,
    Kind.PAUSE: 4,
}


@dataclass(frozen=True)
class ProtocolAnswer:
    """Whether the controller speaks the asked version."""

    accepted: bool


@dataclass(frozen=True)
class ControllerVersion:
    """PolyScope, for example 5.12.0.1101."""

    major: int
    minor: int
    bugfix: int
    build: int


@dataclass(frozen=True)
class TextMessage:
    """Level 0 exception, 1 error, 2 warning, 3 info."""

    level: int
    text: str
    source: str


@dataclass(frozen=True)
class OutputsAnswer:
    """Types in the order asked for; NOT_FOUND where the controller has no such variable."""

    recipe_id: int
    types: tuple[str, ...]


@dataclass(frozen=True)
class StartAnswer:
    """Whether data packages will come."""

    accepted: bool


@dataclass(frozen=True)
class PauseAnswer:
    """Whether data packages have ceased."""

    accepted: bool


@dataclass(frozen=True)
class Data:
    """Consecutive data packages of the recipe that `expect` has named, in a structured array (package,)."""

    packages: NDArray[Any]


@dataclass(frozen=True)
class Unknown:
    """A frame of a known type whose payload does not fit it, or that a client does not get."""

    kind: int
    payload: bytes


@dataclass(frozen=True)
class RtdeJunk:
    """Bytes that are no RTDE frame; the stream cannot be found again, everything after them is dropped."""

    offset: int  # in the stream
    head: bytes  # the first 32 bytes


Message = (
    ProtocolAnswer
    | ControllerVersion
    | TextMessage
    | OutputsAnswer
    | StartAnswer
    | PauseAnswer
    | Data
    | Unknown
    | RtdeJunk
)


class RtdeCodec:
    """One connection's bytes; `feed` takes any split of the stream."""

    def __init__(self) -> None:
        self._pending = b""
        self._offset = 0
        self._junk = False
        self._dtype: np.dtype[Any] | None = None
        self._head = b""

    def expect(self, recipe_id: int, names: Sequence[str], types: Sequence[str]) -> None:
        """Data packages from now on are of this recipe. KeyError for a type that RTDE does not have."""
        fields: list[tuple[str, str, tuple[int, ...]]] = [("_size", ">u2", ()), ("_kind", "u1", ()), ("_id", "u1", ())]
        fields += [(name, *DTYPES[kind]) for name, kind in zip(names, types, strict=True)]
        self._dtype = np.dtype(fields)
        self._head = HEADER.pack(self._dtype.itemsize, Kind.DATA) + bytes([recipe_id])

    def feed(self, data: bytes) -> list[Message]:
        """The messages that are complete now, in order."""
        if self._junk:
            return []
        buffer = self._pending + data
        messages: list[Message] = []
        at = 0
        while len(buffer) - at >= HEADER.size:
            run = self._run_of_data(buffer, at)
            if run is not None:
                messages.append(Data(run))
                at += run.nbytes
                continue
            size, kind = HEADER.unpack_from(buffer, at)
            if self._impossible(size, kind, buffer, at):
                self._junk = True
                messages.append(RtdeJunk(self._offset + at, buffer[at : at + HEAD_SHOWN]))
                return messages
            if len(buffer) - at < size:
                break
            messages.append(_decode(kind, buffer[at + HEADER.size : at + size]))
            at += size
        self._pending = buffer[at:]
        self._offset += at
        return messages

    def _impossible(self, size: int, kind: int, buffer: bytes, at: int) -> bool:
        """No frame of that kind has that size: so good ones behind a damaged length are not taken for its payload."""
        if kind not in LONGEST or not HEADER.size <= size <= LONGEST[Kind(kind)]:
            return True
        ours = self._head[2:4] != b"" and buffer[at + 2 : at + 4] == self._head[2:4]
        return ours and size != HEADER.unpack_from(self._head)[0]

    def _run_of_data(self, buffer: bytes, at: int) -> NDArray[Any] | None:
        """As many whole packages of the expected recipe as stand at `at`; None when there is none."""
        if self._dtype is None or not buffer.startswith(self._head, at):
            return None
        count = (len(buffer) - at) // self._dtype.itemsize
        if count == 0:
            return None
        packages = np.frombuffer(buffer, self._dtype, count, at)
        same = (
            (packages["_size"] == self._dtype.itemsize)
            & (packages["_kind"] == Kind.DATA)
            & (packages["_id"] == self._head[-1])
        )
        return packages if same.all() else packages[: int(np.argmin(same))]


def encode_protocol_request() -> bytes:
    return _frame(Kind.PROTOCOL_VERSION, struct.pack(">H", PROTOCOL_VERSION))


def encode_version_request() -> bytes:
    return _frame(Kind.CONTROLLER_VERSION)


def encode_outputs_request(rate_hz: float, names: Sequence[str]) -> bytes:
    """Version 2: frequency, then names with commas between them."""
    return _frame(Kind.OUTPUTS, struct.pack(">d", rate_hz) + ",".join(names).encode())


def encode_start() -> bytes:
    return _frame(Kind.START)


def _frame(kind: Kind, payload: bytes = b"") -> bytes:
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def _decode(kind: int, payload: bytes) -> Message:
    match kind:
        case Kind.PROTOCOL_VERSION if len(payload) == 1:
            return ProtocolAnswer(payload[0] != 0)
        case Kind.CONTROLLER_VERSION if len(payload) == 16:
            return ControllerVersion(*struct.unpack(">4I", payload))
        case Kind.OUTPUTS if payload:
            return OutputsAnswer(payload[0], _names(payload[1:]))
        case Kind.START if len(payload) == 1:
            return StartAnswer(payload[0] != 0)
        case Kind.PAUSE if len(payload) == 1:
            return PauseAnswer(payload[0] != 0)
        case Kind.TEXT:
            return _decode_text(payload)
        case _:
            return Unknown(kind, payload)


def _names(text: bytes) -> tuple[str, ...]:
    return tuple(name for name in text.decode("ascii", errors="replace").split(",") if name)


def _decode_text(payload: bytes) -> Message:
    """Version 2: length, text, length, source, level."""
    text_end = 1 + payload[0] if payload else 0
    if text_end >= len(payload):
        return Unknown(Kind.TEXT, payload)
    source_end = text_end + 1 + payload[text_end]
    if source_end + 1 != len(payload):
        return Unknown(Kind.TEXT, payload)
    text = payload[1:text_end].decode(errors="replace")
    return TextMessage(payload[source_end], text, payload[text_end + 1 : source_end].decode(errors="replace"))
