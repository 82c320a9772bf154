"""Encoder angles out of recorded CAN frames: what the driver of these encoders reads live.

Plain encoders by the DBC file of the rig; those of CiA 406 by their set-up, which the log holds where it began before
it: the scale that each states over SDO, and what TPDO2 carries. Without that, by `units_per_turn` of the rig file and
the predefined TPDO2 (CiA 301, 7.3.3; CiA 406: the position is its first object).

A row is complete when every encoder has sent, or when one sends again before the others did, as in
`drivers.can_dbc.device`; its time is the mean of the frames' own. A SYNC begins a row, and is its time: then all latch.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from acquisition.recording import Channel, Recording, RecordingError, Stream
from acquisition.recording.can_frames import Frame, FrameFlag, frames_of, is_frames
from acquisition.recording.check_recording import NO_READING
from acquisition.recording.foreign import Sheet
from acquisition.recording.rig.devices import EncoderDriver, EncodersDevice
from drivers.can_dbc.description import JointSignal, joint_signals
from drivers.can_dbc.layouts import jumps_of
from drivers.can_dbc.rows import EncoderRow, EncoderSignal, RowsOfFrames
from drivers.cia406 import codec
from drivers.cia406.codec import SPEED_LIMIT_RAD_S, Scale

STREAM, CHANNEL = "encoders", "position_rad"

SDO_ANSWER, SDO_REQUEST, PDO2 = 0x580, 0x600, 0x280  # and the node: the predefined connection set of CiA 301
SET_UP = (codec.OPERATING_PARAMETERS, codec.UNITS_PER_TURN, codec.RANGE_UNITS, codec.TURN_RESOLUTION, codec.TURNS)


@dataclass(frozen=True)
class Row:
    """Host time in s; (joint,) angles in rad, NaN where there is none; (joint,) why: 0, or of `NoReading`."""

    host_s: float
    angles_rad: tuple[float, ...]
    no_reading: tuple[int, ...]


@dataclass(frozen=True)
class EncoderLog:
    """The rows of all encoders; `warnings`: signals that jump as the DBC file places them, and where they would not."""

    rows: list[Row]
    warnings: tuple[str, ...] = ()


class NoSetUpError(RecordingError):
    """Nothing in log or rig file states what a count of the encoders is."""


@dataclass(frozen=True)
class NodePosition:
    """The position of one CiA 406 encoder in its TPDO2."""

    name: str
    frame: tuple[int, bool]
    scale: Scale
    number: codec.MappedNumber

    def counts(self, data: bytes) -> int | None:
        """None when the frame is too short."""
        return self.number.read(data)


def encoder_rows(recording: Recording, encoders: EncodersDevice) -> EncoderLog:
    """Host time and angle of every joint, NaN with the reason where there is none.

    RecordingError where no frame is of these encoders, or several buses have them; NoSetUpError; DeviceRefused for a
    DBC file that does not fit.
    """
    buses = [list(frames_of(stream)) for stream in recording.streams.values() if is_frames(stream)]
    plain = encoders.driver is EncoderDriver.CAN_DBC
    joints: Sequence[EncoderSignal] = (
        joint_signals(Path(encoders.dbc or ""), encoders.signals, encoders.units_per_turn)
        if plain
        else _node_positions(recording.path, [frame for bus in buses for frame in bus], encoders)
    )
    ours = {joint.frame for joint in joints}
    theirs = [bus for bus in buses if any((f.can_id, bool(f.flags & FrameFlag.EXTENDED)) in ours for f in bus)]
    if len(theirs) > 1:
        raise RecordingError(
            f"{recording.path}: frames of these encoders are on {len(theirs)} channels of the log; export one of them"
        )
    frames = [frame for bus in buses for frame in bus] if not theirs else theirs[0]
    limit = encoders.acceleration_limit_rad_s2
    sync = None if plain else codec.SYNC_ID
    frames.sort(key=lambda f: f.host_s)
    rows = list(_rows(frames, joints, math.inf if limit is None else limit, sync))
    if not rows:
        raise RecordingError(
            f"{recording.path}: none of {len(frames)} frames is of {joints[0].name} … {joints[-1].name} of "
            f"{encoders.dbc if plain else 'CiA 406'}; check [devices.encoders] of the rig file"
        )
    return EncoderLog(rows, tuple(_jumps(frames, joints)))


def _jumps(frames: Sequence[Frame], joints: Sequence[EncoderSignal]) -> Iterator[str]:
    for joint in joints:
        if not isinstance(joint, JointSignal):  # CiA 406: the mapping of the encoder states the place
            continue
        own = [
            frame
            for frame in frames
            if (frame.can_id, bool(frame.flags & FrameFlag.EXTENDED)) == joint.frame
            and not frame.flags & (FrameFlag.REMOTE | FrameFlag.ERROR)
            and joint.counts(frame.data) is not None
        ]
        jumps = jumps_of(joint, [frame.host_s for frame in own], [frame.data for frame in own])
        if jumps is not None:
            yield str(jumps)


def encoder_stream(rows: list[Row], frames: Recording) -> Stream:
    """As the driver of these encoders streams them; the stamps are those of the frames, which all come of one log."""
    log = next((stream for stream in frames.streams.values() if is_frames(stream)), None)
    stamps = "unknown" if log is None else log.stamps
    host_s = np.array([row.host_s for row in rows])
    angles_rad = np.array([row.angles_rad for row in rows])
    shape = angles_rad.shape[1:]
    values = {CHANNEL: angles_rad, NO_READING: np.array([row.no_reading for row in rows], dtype=np.uint8)}
    channels = Channel(CHANNEL, "rad", shape), Channel(NO_READING, "", shape)
    return Stream(STREAM, channels, host_s, host_s, np.arange(len(rows), dtype=np.int64), values, stamps=stamps)


def encoder_sheet(rows: list[Row], recording: Recording, source: Path) -> Sheet:
    """The same as a table beside other logs: times since 1970, as in the CAN log."""
    epoch = datetime.fromtimestamp(0, UTC)
    start_s = ((recording.started or epoch) - epoch).total_seconds()
    headings = ("host [s]", *(f"enc{joint} [rad]" for joint in range(1, len(rows[0].angles_rad) + 1)))
    cells = tuple((start_s + row.host_s, *row.angles_rad) for row in rows)
    return Sheet(source, "", headings, ("",) * len(headings), cells, tuple(range(1, len(rows) + 1)))


def _node_positions(source: Path, frames: Sequence[Frame], encoders: EncodersDevice) -> tuple[NodePosition, ...]:
    """Of every node of the rig. NoSetUpError naming those whose counts have no size."""
    found = [_node_position(node, _objects(frames, node), encoders.units_per_turn) for node in encoders.nodes]
    missing = [str(node) for node, one in zip(encoders.nodes, found, strict=True) if one is None]
    if missing:
        raise NoSetUpError(
            f"{source}: the set-up of encoder node {', '.join(missing)} is not in it (SDO answers of 6000h to 6502h), "
            "so the size of a count is not known; give 'units_per_turn' in [devices.encoders] of the rig file"
        )
    return tuple(one for one in found if one is not None)


def _node_position(
    node: int, objects: Mapping[tuple[int, int], int], units_per_turn: float | None
) -> NodePosition | None:
    mapping = tuple(
        codec.mapped_object(objects.get((codec.TPDO2_MAPPING, entry), 0))
        for entry in range(1, (objects.get((codec.TPDO2_MAPPING, 0), 0) & 0xFF) + 1)  # UNSIGNED8
    )
    number = codec.mapped_number(mapping, codec.POSITION) or codec.MappedNumber(0, 32)
    pdo_id = objects.get((codec.TPDO2_COMMUNICATION, 1), PDO2 + node) & 0x7FF
    operating, units, span, resolution, turns = (objects.get((index, 0), 0) for index in SET_UP)
    try:
        scale = codec.scale_of(operating, units, span, resolution, max(turns, 1))
    except ValueError:  # not in the log
        if units_per_turn is None:
            return None
        # any range is whole turns, so the place within one turn, followed from row to row, is enough
        scale = Scale(units_per_turn, round(units_per_turn), rises_counter_clockwise=True)
    return NodePosition(f"node {node}", (pdo_id, False), scale, number)


def _objects(frames: Iterable[Frame], node: int) -> dict[tuple[int, int], int]:
    """What a node has answered or was set to over expedited SDO, the last of each object (CiA 301, 7.2.4.3)."""
    objects: dict[tuple[int, int], int] = {}
    kinds = {SDO_ANSWER + node: 0x40, SDO_REQUEST + node: 0x20}  # upload answered, download asked for
    for frame in frames:
        kind = kinds.get(frame.can_id)
        if kind is None or len(frame.data) != 8 or frame.data[0] & 0xE2 != kind | 0x02:
            continue
        size = 4 - (frame.data[0] >> 2 & 3) if frame.data[0] & 1 else 4
        index = int.from_bytes(frame.data[1:3], "little")
        objects[index, frame.data[3]] = int.from_bytes(frame.data[4 : 4 + size], "little")
    return objects


def _rows(
    frames: Iterable[Frame], joints: Sequence[EncoderSignal], acceleration_limit: float, sync: int | None
) -> Iterator[Row]:
    following = RowsOfFrames(joints, SPEED_LIMIT_RAD_S, acceleration_limit)
    latched_s: float | None = None
    for frame in frames:
        if frame.flags & (FrameFlag.REMOTE | FrameFlag.ERROR):
            continue
        known = frame.can_id, bool(frame.flags & FrameFlag.EXTENDED)
        if frame.can_id == sync and not following.places(known):
            yield from (_finished(row, latched_s) for row in following.finish())
            latched_s = frame.host_s
            continue
        for row in following.take(known, frame.data, frame.host_s):
            yield _finished(row, latched_s)
            latched_s = None
    yield from (_finished(row, latched_s) for row in following.finish())


def _finished(row: EncoderRow, latched_s: float | None) -> Row:
    mean_s = math.fsum(reading.time_s for reading in row.readings.values()) / len(row.readings)
    return Row(mean_s if latched_s is None else latched_s, row.angles_rad(), row.no_reading())
