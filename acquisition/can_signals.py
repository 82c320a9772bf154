"""Encoder angles out of recorded CAN frames, by the DBC file of the rig: what the driver of plain encoders reads live.

A row is complete when every encoder has sent, or when one sends again before the others did, as in
`drivers.can_dbc.device`; its time is the mean of the frames' own.
"""

import math
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from acquisition.recording import Channel, Recording, RecordingError, Stream
from acquisition.recording.can_frames import Frame, FrameFlag, frames_of, is_frames
from acquisition.recording.foreign import Sheet
from acquisition.recording.rig.devices import EncoderDriver, EncodersDevice
from drivers.can_dbc.description import JointSignal, joint_signals
from drivers.cia406.codec import SPEED_LIMIT_RAD_S, ContinuousAngle

STREAM, CHANNEL = "encoders", "position_rad"
Row = tuple[float, tuple[float, ...]]


def described_by_dbc(encoders: EncodersDevice | None) -> bool:
    """Whether a rig's encoders are read by a DBC file."""
    return encoders is not None and encoders.driver is EncoderDriver.CAN_DBC and encoders.dbc is not None


def encoder_rows(recording: Recording, encoders: EncodersDevice) -> list[Row]:
    """Host time and angle of every joint, NaN where an encoder sent nothing for that row.

    RecordingError where no frame is of these encoders, or several buses have them; DeviceRefused for a DBC file that
    does not fit.
    """
    joints = joint_signals(Path(encoders.dbc or ""), encoders.signals, encoders.units_per_turn)
    ours = {joint.frame for joint in joints}
    buses = [list(frames_of(stream)) for stream in recording.streams.values() if is_frames(stream)]
    theirs = [bus for bus in buses if any((f.can_id, bool(f.flags & FrameFlag.EXTENDED)) in ours for f in bus)]
    if len(theirs) > 1:
        raise RecordingError(
            f"{recording.path}: frames of these encoders are on {len(theirs)} channels of the log; export one of them"
        )
    frames = [frame for bus in buses for frame in bus] if not theirs else theirs[0]
    limit = encoders.acceleration_limit_rad_s2
    rows = list(_rows(sorted(frames, key=lambda f: f.host_s), joints, math.inf if limit is None else limit))
    if not rows:
        raise RecordingError(
            f"{recording.path}: none of {len(frames)} frames is of {joints[0].name} … {joints[-1].name} of "
            f"{encoders.dbc}; check [devices.encoders] of the rig file"
        )
    return rows


def encoder_stream(rows: list[Row]) -> Stream:
    """As the driver of these encoders streams them; stamped by the bus adapter."""
    host_s = np.array([time_s for time_s, _ in rows])
    angles_rad = np.array([angles for _, angles in rows])
    channel = Channel(CHANNEL, "rad", angles_rad.shape[1:])
    return Stream(STREAM, (channel,), host_s, host_s, np.arange(len(rows), dtype=np.int64), {CHANNEL: angles_rad})


def encoder_sheet(rows: list[Row], recording: Recording, source: Path) -> Sheet:
    """The same as a table beside other logs: times since 1970, as in the CAN log."""
    epoch = datetime.fromtimestamp(0, UTC)
    start_s = ((recording.started or epoch) - epoch).total_seconds()
    headings = ("host [s]", *(f"enc{joint} [rad]" for joint in range(1, len(rows[0][1]) + 1)))
    cells = tuple((start_s + time_s, *angles) for time_s, angles in rows)
    return Sheet(source, "", headings, ("",) * len(headings), cells, tuple(range(1, len(rows) + 1)))


def _rows(frames: Iterable[Frame], joints: tuple[JointSignal, ...], acceleration_limit: float) -> Iterator[Row]:
    angles = tuple(ContinuousAngle(joint.scale, SPEED_LIMIT_RAD_S, acceleration_limit) for joint in joints)
    places: dict[tuple[int, bool], list[int]] = {}
    for place, joint in enumerate(joints):
        places.setdefault(joint.frame, []).append(place)
    row: dict[int, tuple[float, float]] = {}  # place -> angle, time
    for frame in frames:
        here = places.get((frame.can_id, bool(frame.flags & FrameFlag.EXTENDED)), [])
        if not here or frame.flags & (FrameFlag.REMOTE | FrameFlag.ERROR):
            continue
        if any(place in row for place in here):
            yield _finished(row, len(joints))
            row = {}
        for place in here:
            counts = joints[place].counts(frame.data)
            if counts is not None:
                angle_rad = angles[place].follow(counts, frame.host_s) + joints[place].offset_rad
                row[place] = angle_rad, frame.host_s
        if len(row) == len(joints):
            yield _finished(row, len(joints))
            row = {}
    if row:
        yield _finished(row, len(joints))


def _finished(row: dict[int, tuple[float, float]], n_joints: int) -> Row:
    angles = tuple(row[place][0] if place in row else math.nan for place in range(n_joints))
    return math.fsum(time_s for _, time_s in row.values()) / len(row), angles
