"""CAN frames in and out: BLF (Vector), ASC, CSV and candump files through python-can, from and to recordings.

A file's channels become streams: `can`, or `can-<channel>` where it names them. Absolute times are kept: a frame's
host time counts from the first frame, whose date is the recording's start. Where a recording has lost its date, times
in the file count from its first frame. Formats that need a data base or another
package (.db, .mf4) are not taken: python-can's .db writer loses frames when it is stopped.

Apart from `can_frames`, because this loads python-can, and a fit reads recordings without it.
"""

import math
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, TextIO, cast

import can
import msgspec
import numpy as np
from can.io.blf import BLFParseError
from can.io.generic import MessageReader, MessageWriter

from acquisition.recording.can_frames import (
    CHANNELS_NOTE,
    CLASSIC_BYTES,
    FD_BYTES,
    Frame,
    FrameBlock,
    FrameFlag,
    block_of,
    channels,
    frame_block,
    frames_of,
    is_frames,
    stream_names,
)
from acquisition.recording.can_log_facts import AscLines, by_vector, remarks_of
from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.files.bounds import BATCH_BYTES, FEW, MESSAGES, SPAN_S, TABLE_BYTES, TIME_S, UNPACKED_BYTES
from acquisition.recording.mcap.writer import RecordingWriter, StreamWriter
from acquisition.recording.recording import Recording, Stamps, time_utc

_FLAGS = (
    ("is_extended_id", int(FrameFlag.EXTENDED)),
    ("is_remote_frame", int(FrameFlag.REMOTE)),
    ("is_error_frame", int(FrameFlag.ERROR)),
    ("is_fd", int(FrameFlag.FD)),
    ("bitrate_switch", int(FrameFlag.BIT_RATE_SWITCH)),
    ("error_state_indicator", int(FrameFlag.ERROR_STATE)),
)
_SENT = int(FrameFlag.SENT)
_flagged = attrgetter(*(name for name, _ in _FLAGS))  # in one call: nearly all frames have none of them
_PLAIN = (False,) * len(_FLAGS)


def frame_of(message: can.Message, host_s: float, *, sent: bool) -> Frame:
    """A frame as it was heard, or sent, at host time `host_s`."""
    flags, data = _SENT if sent else 0, message.data
    if True in _flagged(message):
        flags |= sum(flag for name, flag in _FLAGS if getattr(message, name))
        data = b"" if message.is_remote_frame else data
    stamp_s = math.nan if sent or not message.timestamp else message.timestamp
    return Frame(host_s, stamp_s, message.arbitration_id, flags, message.dlc, bytes(data))


def plain_block(heard: Sequence[tuple[Sequence[can.Message], float, bool]]) -> FrameBlock | None:
    """What `block_of` makes of the frames of (messages, host_s, sent), in two thirds of the time: no object a frame.

    None where one of them is no data frame of up to 8 bytes with an identifier of 11 bits.
    """
    messages = [message for several, _, _ in heard for message in several]
    payloads = [message.data for message in messages]
    plain = list(map(_flagged, messages)).count(_PLAIN) == len(messages)
    if not plain or max(map(len, payloads), default=0) > CLASSIC_BYTES:
        return None
    counts = [len(several) for several, _, _ in heard]
    host_s, sent = np.repeat([each[1] for each in heard], counts), np.repeat([each[2] for each in heard], counts)
    stamps_s = np.array([message.timestamp for message in messages], dtype=np.float64)
    device_s, flags = np.where(sent | (stamps_s == 0.0), math.nan, stamps_s), np.where(sent, _SENT, 0)
    can_id, length = [message.arbitration_id for message in messages], [message.dlc for message in messages]
    return frame_block((host_s, device_s, can_id, flags, length), payloads, CLASSIC_BYTES)


def message_of(frame: Frame, time_s: float, channel: int | str | None) -> can.Message:
    """A frame for python-can's files; `time_s` since 1970. ValueError for one that cannot be a CAN frame."""
    named = {name: bool(frame.flags & flag) for name, flag in _FLAGS}
    return can.Message(
        timestamp=time_s,
        arbitration_id=frame.can_id,
        dlc=frame.length,
        data=None if frame.flags & FrameFlag.REMOTE else frame.data,
        channel=channel,
        is_rx=not frame.flags & _SENT,
        check=True,
        **named,
    )


BLOCK = 10_000  # frames at a time into the recording
MALFORMED = (  # what python-can's readers raise on lines and bytes that make no sense
    BLFParseError,
    EOFError,
    IndexError,
    KeyError,
    OverflowError,
    TypeError,
    ValueError,
    can.CanError,
    struct.error,
    zlib.error,
)


def _asc_reader(file: Any) -> MessageReader:
    return can.ASCReader(cast("TextIO", AscLines(file)), relative_timestamp=False)


_READERS: Mapping[str, Callable[[Any], MessageReader]] = MappingProxyType(
    {
        ".blf": can.BLFReader,
        ".asc": _asc_reader,
        ".csv": can.CSVReader,
        ".log": can.CanutilsLogReader,
    }
)
_WRITERS: Mapping[str, Callable[[Path], MessageWriter]] = MappingProxyType(
    {".blf": can.BLFWriter, ".asc": can.ASCWriter, ".csv": can.CSVWriter, ".log": can.CanutilsLogWriter}
)
SUFFIXES = tuple(_READERS)


@dataclass(frozen=True)
class CanImport:
    """What an import brought.

    `damage` states where the file could not be read further, `remarks` what the log leaves open or its reader left out.
    """

    frames: int
    streams: tuple[str, ...]
    damage: str | None
    remarks: tuple[str, ...] = ()


def import_can(source: Path, path: Path, *, rig_text: str, software: str) -> CanImport:
    """Make a recording of a CAN log; its kind is known by its suffix.

    RecordingError when it cannot be opened, holds no frame, or is of no known kind; of a damaged one everything before
    the damage is kept, and the recording is not complete.
    """
    survey = _surveyed(source)
    stamps = stamps_of_log(source)
    log = _Log(source)
    with RecordingWriter(
        path,
        rig_text=rig_text,
        software=software,
        clock=_FirstFrame(),
        notes={"imported_from": source.name, CHANNELS_NOTE: msgspec.json.encode(survey.channels).decode()},
        started_utc=datetime.fromtimestamp(0, UTC) + timedelta(seconds=survey.start_s),
    ) as writer:
        inlets = {
            channel: _Inlet(writer.stream(name, channels(survey.width), viewer=(), stamps=stamps), survey)
            for name, channel in survey.channels.items()
        }
        for message in log:
            inlets[_bus(message)].take(message)
        for inlet in inlets.values():
            inlet.write()
        writer.close(complete=log.damage is None)
    frames = sum(inlet.count for inlet in inlets.values())
    remarks = tuple(remarks_of(source, frames if log.damage is None else None))
    return CanImport(frames, tuple(survey.channels), log.damage, remarks)


def stamps_of_log(source: Path) -> Stamps:
    """What the format states: `hardware` in logs that Vector's tools wrote, `arrived` (the host's kernel) in candump.

    Unknown elsewhere: python-can writes the same formats, with whatever stamps its interface gave. RecordingError.
    """
    suffix = source.suffix.lower()
    if suffix == ".log":
        return "arrived"
    try:
        return "hardware" if by_vector(source) else "unknown"
    except OSError as error:
        raise RecordingError(f"{source}: cannot read it ({error.strerror}); check the path") from error


def export_can(recording: Recording, path: Path) -> int:
    """Write every raw frame of a recording, all its buses by time; the number of frames.

    RecordingError when there is none, the suffix is unknown, the file exists, or the disk refuses.
    """
    make = _WRITERS.get(path.suffix.lower())
    if make is None:
        raise RecordingError(f"{path}: no CAN log format '{path.suffix}'; give one of {', '.join(SUFFIXES)}")
    if path.exists():
        raise RecordingError(f"{path}: the file exists; nothing is overwritten, choose another name")
    count = 0
    messages = _messages(recording)
    try:
        with make(path) as writer:
            for message in messages:
                writer.on_message_received(message)
                count += 1
    except OSError as error:
        raise RecordingError(f"{path}: cannot write the CAN log ({error.strerror}); choose another place") from error
    return count


def _messages(recording: Recording) -> Iterator[can.Message]:
    streams = [stream for stream in recording.streams.values() if is_frames(stream)]
    if not streams:
        raise RecordingError(
            f"{recording.path}: no raw CAN frames in it; record them with `calibeam log encoders --raw`"
        )
    named: dict[str, int | str | None] = msgspec.json.decode(recording.notes.get(CHANNELS_NOTE, "{}"))
    start_s = _since_1970(recording.started_utc) - recording.host_s0
    if not math.isfinite(start_s):
        start_s = -min((float(stream.host_s[0]) for stream in streams if stream.host_s.size), default=0.0)
    rows: list[tuple[float, int | str | None, Frame]] = []
    for stream in streams:
        channel = named.get(stream.name)
        rows += [(frame.host_s, channel, frame) for frame in frames_of(stream)]
    if len(streams) > 1:
        rows.sort(key=lambda row: row[0])  # stable: frames of one bus keep their order
    return (message_of(frame, start_s + host_s, channel) for host_s, channel, frame in rows)


class _FirstFrame:
    """The clock of a log that is over: its times count from its first frame."""

    def now_s(self) -> float:
        return 0.0


class _Log:
    """The messages of a file up to its end or to where it makes no sense; then `damage` states it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.damage: str | None = None
        reader = _READERS.get(path.suffix.lower())
        if reader is None:
            raise RecordingError(f"{path}: no CAN log format '{path.suffix}'; give one of {', '.join(SUFFIXES)}")
        self._open = reader
        self._mode = "rb" if path.suffix.lower() == ".blf" else "r"

    def __iter__(self) -> Iterator[can.Message]:
        count, first_s = 0, math.nan
        try:
            most = max(MESSAGES, self._path.stat().st_size // 12)
            if self._mode == "rb":
                _check_containers(self._path)
            # opened here: python-can leaves a file open whose beginning it does not know
            with self._path.open(self._mode) as file, self._open(file) as messages:
                for message in messages:
                    first_s = message.timestamp if count == 0 else first_s
                    if not 0.0 <= message.timestamp <= TIME_S or abs(message.timestamp - first_s) > SPAN_S:
                        raise ValueError(f"time stamp {message.timestamp}")
                    if count == most and self._mode == "r":  # of a binary log the containers are bounded
                        raise ValueError("more frames than a log of this size holds; import it in parts")
                    yield message
                    count += 1
        except OSError as error:
            raise RecordingError(f"{self._path}: cannot read it ({error.strerror or error}); check the path") from error
        except MALFORMED as error:
            self.damage = f"after {count} frames the file makes no sense ({shown(f'{type(error).__name__}: {error}')})"


def _check_containers(path: Path) -> None:
    """ValueError for a BLF file of which a container, or all together, unpack to more than the bounds.

    A container is an object of type 10: sizes and zlib as python-can's reader has them (can/io/blf.py).
    """
    with path.open("rb") as file:
        size = path.stat().st_size
        left = UNPACKED_BYTES if size <= TABLE_BYTES else 20 * size  # calm encoders pack ten to one
        file.seek(int.from_bytes(file.read(8)[4:], "little"))
        while len(head := file.read(16)) == 16 and head.startswith(b"LOBJ"):
            size, kind = struct.unpack("<LL", head[8:])
            body = file.read(max(0, size - 16) + size % 4)
            if kind == 10 and body[:2] == b"\2\0":
                made = len(zlib.decompressobj().decompress(body[16:], BATCH_BYTES + 1))
                left -= made
                if made > BATCH_BYTES or left < 0:
                    raise ValueError(f"byte {file.tell() - len(body)}: too much when unpacked; use a copy of the file")


@dataclass(frozen=True)
class _Survey:
    """What must be known of a file before its first frame can be written."""

    start_s: float
    width: int
    channels: dict[str, int | str | None]  # stream -> channel of the file


def _surveyed(source: Path) -> _Survey:
    log = _Log(source)
    start_s, longest, buses = math.nan, 0, dict[int | str | None, None]()  # in the order of their first frames
    for message in log:
        start_s = message.timestamp if math.isnan(start_s) else start_s
        longest = max(longest, len(message.data))
        buses.setdefault(_bus(message))
        if len(buses) > FEW:
            raise RecordingError(f"{source}: more than {FEW} channels, which no log has; check the file")
    if not buses:
        raise RecordingError(f"{source}: no CAN frame in it ({log.damage or 'it is empty'}); check the file")
    return _Survey(start_s, FD_BYTES if longest > CLASSIC_BYTES else CLASSIC_BYTES, stream_names(buses))


class _Inlet:
    """Frames of one channel into its stream."""

    def __init__(self, stream: StreamWriter, survey: _Survey) -> None:
        self.count = 0
        self._stream, self._survey = stream, survey
        self._frames: list[Frame] = []

    def take(self, message: can.Message) -> None:
        host_s = message.timestamp - self._survey.start_s
        self._frames.append(frame_of(message, host_s, sent=not message.is_rx))
        if len(self._frames) == BLOCK:
            self.write()

    def write(self) -> None:
        if not self._frames:
            return
        block = block_of(self._frames, self._survey.width)
        first, self.count = self.count, self.count + len(self._frames)
        self._frames = []
        self._stream.append(block.host_s, block.device_s, np.arange(first, self.count), block.values)


def _bus(message: can.Message) -> int | str | None:
    """The channel of a file that a message came on; python-can allows bonded ones, which get one name together."""
    channel = message.channel
    return channel if channel is None or isinstance(channel, int | str) else "-".join(map(str, channel))


def _since_1970(started_utc: str) -> float:
    try:
        start = time_utc(started_utc)
    except ValueError:
        return math.nan
    return (start - datetime.fromtimestamp(0, UTC)) / timedelta(seconds=1)
