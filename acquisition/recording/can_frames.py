"""Raw CAN frames as a stream of a recording: one sample a frame, sent ones too, in the order heard.

`host_s` is when the frame reached, or left, this program; `device_s` is the adapter's own stamp, NaN where it has none.
`sequence` counts frames, so that a frame lost between here and the file is a gap.
"""

import enum
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from acquisition.recording.recording import Channel, Stream
from acquisition.recording.samples import Floats

STREAM, FD_STREAM = "can", "can-fd"  # in a log: frames up to 8 bytes; longer ones, counted by themselves
CLASSIC_BYTES, FD_BYTES = 8, 64  # ISO 11898-1: longest payload of a frame
CHANNELS_NOTE = "can_channels"  # note of an import, JSON: stream -> the channel of the file it came from
CAN_ID, FLAGS, LENGTH, DATA = "can_id", "flags", "length", "data"


class FrameFlag(enum.IntFlag):
    """What kind of frame it was; the values stand in files and never change."""

    EXTENDED = 1  # identifier of 29 bits
    REMOTE = 2  # asks for data; `length` is what it asks for
    ERROR = 4  # reported by the adapter: bus off, passive, form, bit, ...
    FD = 8
    BIT_RATE_SWITCH = 16
    ERROR_STATE = 32  # ESI: its sender is error passive
    SENT = 64  # by this program


class Frame(NamedTuple):  # and no dataclass: thousands a second are made of these
    """One frame; `flags` are those of FrameFlag."""

    host_s: float
    device_s: float  # NaN: the adapter gave no stamp
    can_id: int
    flags: int
    length: int
    data: bytes  # empty in a remote frame


@dataclass(frozen=True)
class FrameBlock:
    """Consecutive frames as a stream takes them."""

    host_s: Floats
    device_s: Floats
    values: dict[str, NDArray[np.int64]]


def channels(width: int = CLASSIC_BYTES) -> tuple[Channel, ...]:
    """Of a stream of frames with up to `width` bytes; shorter payloads are filled up with zeros."""
    return (Channel(CAN_ID, ""), Channel(FLAGS, ""), Channel(LENGTH, ""), Channel(DATA, "", (width,)))


def block_of(frames: Sequence[Frame], width: int = CLASSIC_BYTES) -> FrameBlock:
    """ValueError for a payload that is longer than `width`."""
    longest = max([len(frame.data) for frame in frames], default=0)
    if longest > width:
        raise ValueError(f"a CAN frame of {longest} bytes in a stream of {width}; open the stream for CAN FD")
    *columns, payloads = zip(*frames, strict=True) if frames else ((),) * 6
    return frame_block(columns, payloads, width)


def frame_block(columns: Sequence[ArrayLike], payloads: Sequence[bytes | bytearray], width: int) -> FrameBlock:
    """Of the first five columns of `Frame`, (frame,) each, and of payloads that are no longer than `width`."""
    payload = b"".join([data.ljust(width, b"\0") for data in payloads])
    host_s, device_s, can_id, flags, length = columns
    return FrameBlock(
        np.array(host_s, dtype=np.float64),
        np.array(device_s, dtype=np.float64),
        {
            CAN_ID: np.array(can_id, dtype=np.int64),
            FLAGS: np.array(flags, dtype=np.int64),
            LENGTH: np.array(length, dtype=np.int64),
            DATA: np.frombuffer(payload, dtype=np.uint8).reshape(-1, width).astype(np.int64),
        },
    )


def is_frames(stream: Stream) -> bool:
    """Whether a stream holds raw CAN frames."""
    return {CAN_ID, FLAGS, LENGTH, DATA} <= {channel.name for channel in stream.channels}


def frames_of(stream: Stream) -> Iterator[Frame]:
    """The frames of such a stream, in its order."""
    payloads = stream.values[DATA].astype(np.uint8)
    columns = (stream.host_s, stream.device_s, stream.values[CAN_ID], stream.values[FLAGS], stream.values[LENGTH])
    rows = zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    for at, (host_s, device_s, can_id, flags, length) in enumerate(rows):
        data = b"" if int(flags) & FrameFlag.REMOTE else payloads[at, : int(length)].tobytes()
        yield Frame(host_s, device_s, int(can_id), int(flags), int(length), data)


def stream_names(buses: Iterable[int | str | None]) -> dict[str, int | str | None]:
    """The stream of each channel of a file: letters, digits and - only, numbered where two would have one name."""
    named: dict[str, int | str | None] = {}
    for channel in buses:
        plain = STREAM if channel is None else f"{STREAM}-{re.sub(r'[^A-Za-z0-9]+', '-', str(channel))}"
        taken = {name.lower() for name in named}  # case does not separate files on every disk
        names = (plain, *(f"{plain}-{number}" for number in range(2, len(named) + 3)))
        named[next(name for name in names if name.lower() not in taken)] = channel
    return named
