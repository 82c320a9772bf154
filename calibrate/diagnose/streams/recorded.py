"""The tracks that a recording holds, each on its device's own clock, by the names of their channels."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Stream
from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.coarse_clock import Ticks, straight_line
from calibrate.diagnose.streams.track import SIGMA_OF_MEDIAN, Track

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COMMAND, JOINTS, ENCODERS, CURRENTS = "target_q_rad", "actual_q_rad", "position_rad", "photocurrent_a"
JOINT_TORQUE, MOTOR_TORQUE, CURRENT = "joint_torque_nm", "motor_torque_nm", "actual_current_a"


@dataclass(frozen=True, eq=False)
class StreamDevice:
    """A track with its device's counter and the host's stamps."""

    track: Track
    sequence: Ints
    host_s: Floats


def devices_of(recording: Recording) -> Mapping[str, StreamDevice]:
    """Those that the recording has of "command", "joints", "encoders", "spots", "torque"."""
    found = {
        "command": _of(recording, COMMAND, "command"),
        "joints": _of(recording, JOINTS, "joints"),
        "encoders": _of(recording, ENCODERS, "encoders"),
        "spots": _spots(recording),
        "torque": _torque(recording),
    }
    if recording.rig.n_joints:  # of a log of encoders alone each one counts, also where it is silent
        found["encoders"] = _of_some_joints(found["encoders"])
    return {name: device for name, device in found.items() if device is not None}


def start_between(reference: StreamDevice, other: StreamDevice) -> Ticks | None:
    """From the host's stamps: each device's promptest ones, which were delayed least. None where they show nothing."""
    one, two = _host_line(reference), _host_line(other)
    if one is None or two is None:
        return None
    at_s = float(other.track.time_s.mean())
    rate = two[1] / one[1]
    host_s = two[0] + two[1] * at_s
    return Ticks((host_s - one[0]) / one[1] - at_s, rate - 1.0, at_s)


def stamps_scatter_s(device: StreamDevice) -> float:
    """How well the host's stamps give the device's time, in its seconds: scatter of the promptest about their line.

    Infinite without a line.
    """
    line = _host_line(device)
    if line is None:
        return float("inf")
    late_s = (device.host_s - line[0] - line[1] * device.track.time_s)[_prompt(device)]
    return SIGMA_OF_MEDIAN * float(np.median(np.abs(late_s))) / line[1]


def _stream(recording: Recording, channel: str) -> Stream | None:
    return next((s for s in recording.streams.values() if channel in s.values and len(s.host_s)), None)


def _of(recording: Recording, channel: str, name: str) -> StreamDevice | None:
    stream = _stream(recording, channel)
    if stream is None:
        return None
    values = np.asarray(stream.values[channel], dtype=float)
    values = values.reshape(len(values), math.prod(values.shape[1:]))  # also of a stream without a sample
    return StreamDevice(Track(name, "rad", stream.device_s, values), stream.sequence, stream.host_s)


def _of_some_joints(device: StreamDevice | None) -> StreamDevice | None:
    """Without the channels of joints that have no reading at all."""
    if device is None:
        return None
    there = np.flatnonzero(np.any(np.isfinite(device.track.values), axis=0))
    if len(there) in (0, device.track.channels):
        return device
    return replace(device, track=device.track.of(there.tolist()))


def _torque(recording: Recording) -> StreamDevice | None:
    """In Nm at the joint. Of motors by the gear ratios of the rig file, of currents by its torques per ampere; a joint
    that has none is left out.
    """
    joints = recording.rig.arm.joints
    for channel, ratios in (
        (JOINT_TORQUE, [1.0] * len(joints)),
        (MOTOR_TORQUE, [joint.gear_ratio or np.nan for joint in joints]),
        (CURRENT, [joint.torque_per_ampere or np.nan for joint in joints]),
    ):
        device = _of(recording, channel, "torque")
        if device is not None and device.track.channels == len(joints) and np.isfinite(ratios).any():
            device = replace(device, track=replace(device.track, values=device.track.values * np.array(ratios)))
            break
    else:
        return None
    device = _of_some_joints(device)
    return None if device is None else replace(device, track=replace(device.track, unit="Nm"))


def _spots(recording: Recording) -> StreamDevice | None:
    """Of every photocurrent, by the duo-lateral formula (On-Trak Photonics, "PSD theory"); NaN unless both are lit."""
    stream, fixture = _stream(recording, CURRENTS), recording.rig.fixture
    if stream is None or fixture is None:
        return None
    current = np.asarray(stream.values[CURRENTS], dtype=float).reshape(-1, 2, 2, 2)  # face, axis, electrode
    total = current.sum(axis=3)
    with np.errstate(invalid="ignore", divide="ignore"):
        spot = fixture.half_size_m * (current[..., 1] - current[..., 0]) / total
    lit = np.isfinite(total).any()
    usual = np.nanpercentile(total, 90.0, axis=0) if lit else np.full(total.shape[1:], np.nan)
    dark = np.any(~(total > limits.DARK * usual), axis=(1, 2))
    values = np.where(dark[:, None], np.nan, spot.reshape(-1, 4))
    return StreamDevice(Track("spots", "m", stream.device_s, values), stream.sequence, stream.host_s)


def _host_line(device: StreamDevice) -> tuple[float, float] | None:
    """Level and rate of host = level + rate device, through the least delayed stamps."""
    prompt = _prompt(device)
    if len(prompt) < limits.PROMPT_WINDOWS // 2:
        return None
    level, rate = straight_line(device.track.time_s[prompt], device.host_s[prompt])
    return (level, rate) if rate > 0.0 else None


def _prompt(device: StreamDevice) -> list[int]:
    """The sample of each window that came least late."""
    t, host = device.track.time_s, device.host_s
    if len(t) < 4 * limits.PROMPT_WINDOWS or not np.ptp(t) > 0.0 or not np.ptp(host) > 0.0:
        return []
    late = host - np.ptp(host) / np.ptp(t) * t
    edges = np.linspace(t[0], t[-1], limits.PROMPT_WINDOWS + 1)
    at = (np.flatnonzero((t >= a) & (t <= b)) for a, b in pairwise(edges))
    return [int(rows[np.argmin(late[rows])]) for rows in at if len(rows)]


def by_host(time_s: Floats, own: StreamDevice, other: StreamDevice) -> Floats:
    """Times of `own` on the clock of `other`, by the host's stamps of both: good to what the lines delay."""
    host_s = np.interp(time_s, own.track.time_s, np.maximum.accumulate(own.host_s))
    return np.interp(host_s, np.maximum.accumulate(other.host_s), other.track.time_s)
