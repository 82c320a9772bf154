"""Every finder over the streams of one recording: what is wrong with them, where, how much, and what is not found."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.examination import ExaminationRecord, not_examined
from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.angle_offsets import AngleOffset, GravityLevers, angle_offsets
from calibrate.diagnose.streams.clock import ClockFit, ClockStatus, clock_between
from calibrate.diagnose.streams.clock_faults import judged, lateness, shares_host_clock
from calibrate.diagnose.streams.coarse_clock import Ticks
from calibrate.diagnose.streams.continuity import Fault, breaks
from calibrate.diagnose.streams.deflection import Deflection, deflections
from calibrate.diagnose.streams.following import Following, following
from calibrate.diagnose.streams.recorded import StreamDevice, by_host, start_between
from calibrate.diagnose.streams.ringing import Levers, ringing
from calibrate.diagnose.streams.settling import Stand, Window, stands_of, unsettled
from calibrate.diagnose.streams.slips import Causes, Slips, slips
from calibrate.diagnose.streams.stream_examinations import StreamsSeen, stream_examinations
from calibrate.diagnose.streams.stream_findings import (
    StreamFinding,
    break_findings,
    deflection_finding,
    following_finding,
    late_finding,
    offset_findings,
    reading_lag_finding,
    ringing_finding,
    slip_finding,
    unsettled_finding,
)
from calibrate.diagnose.streams.track import SIGMA_OF_MEDIAN, Outcome, Track

Floats = NDArray[np.float64]
Predicted = Callable[[Floats, Floats], Floats]  # (row, joint) rad and (row,) joints' clock -> (row, 4) spots, NaN: none

NUDGE_RAD = 1e-5  # of a joint, for its lever on the spots: far below what bends the beam's path


@dataclass(frozen=True, eq=False)
class StreamReport:
    """`clocks`: other device -> its clock against the joints' one; `offsets`: stream -> its joints, one by one."""

    findings: tuple[StreamFinding, ...]
    clocks: Mapping[str, ClockFit]
    following: tuple[Following, ...]
    stands: tuple[Stand, ...]
    examinations: tuple[ExaminationRecord, ...]
    offsets: Mapping[str, tuple[AngleOffset, ...]] = field(default_factory=dict[str, tuple[AngleOffset, ...]])

    @property
    def unseen(self) -> tuple[str, ...]:
        """What of the recorded devices this recording does not show, in sentences."""
        left = (one for one in not_examined(self.examinations) if one.expected)
        return tuple(f"{one.what}{f' ({one.where})' if one.where else ''}: {one.reason}" for one in left)


def examine(
    devices: Mapping[str, StreamDevice],
    predicted: Predicted | None = None,
    windows: Sequence[Window] | None = None,
    causes: Causes | None = None,
    levers: GravityLevers | None = None,
    zeros_rad: Sequence[float | None] = (),
    *,
    arm: bool = True,
    stated: frozenset[str] = frozenset(),
) -> StreamReport:
    """Streams as `devices_of` gives them. `predicted`: a model's word on the spots; without it their clock is open.

    `windows`: when the samples were taken, on the clock of the spots, one a sample. `causes`: what physics may do
    between the two encoders of a joint. `levers`: torque of gravity about each joint. `zeros_rad`: what the second
    encoder of each joint shows at the joint's zero, where that is stated. `arm`: False of a log of encoders alone.
    `stated`: devices of the rig, recorded or not.
    """
    found, devices = _mended(devices)
    devices, silent = _answering(devices)
    if "encoders" in stated:  # the rig has them, so that a joint without a reading has a silent one
        silent |= _without_reading(devices)
    joints, command = devices.get("joints"), devices.get("command")
    if joints is None:
        nothing = StreamsSeen(devices, tuple(found), silent=silent, stated=stated)
        return StreamReport(tuple(found), {}, (), (), stream_examinations(nothing, arm=arm))
    stands = stands_of((command or joints).track)
    clocks: dict[str, ClockFit] = {}
    behind: tuple[Following, ...] = ()
    second: _Second | None = None
    offsets: dict[str, tuple[AngleOffset, ...]] = {}
    if command is not None:
        behind = following(command.track, joints.track)
        found += [following_finding(one) for one in behind if one.outcome is Outcome.FOUND]
        offsets["joints"] = angle_offsets(joints.track, command.track, levers, wraps=False)
    if "encoders" in devices:
        second = _encoders(joints, devices["encoders"], stands, causes, devices.get("torque"), levers, zeros_rad)
        clocks["encoders"], offsets["encoders"] = second.clock, second.offsets
        found += second.findings
    found += [more for name, each in offsets.items() for one in each for more in offset_findings(name, one)]
    if "spots" in devices:
        seen = _spots(joints, devices["spots"], stands, predicted)
        found += seen.findings + _unsettled(devices["spots"], seen, windows, stands, joints.track.channels)
        if seen.clock is not None:
            clocks["spots"] = seen.clock
    for name, fit in clocks.items():
        late = lateness(joints, devices[name], fit)
        if late is not None and late.counts:
            found.append(late_finding(name, late, joints.track.channels))
    found += _rings(joints.track, stands)
    bent, judged_slips = ((), ()) if second is None else (second.bent, second.judged)
    seen_all = StreamsSeen(
        devices, tuple(found), clocks, behind, offsets, bent, judged_slips, stands, windows, silent, stated
    )
    return StreamReport(tuple(found), clocks, behind, stands, stream_examinations(seen_all), offsets)


def _mended(devices: Mapping[str, StreamDevice]) -> tuple[list[StreamFinding], dict[str, StreamDevice]]:
    """What is broken in each stream, and the streams with steps of their clocks taken out.

    Joints share the clock of their set-point; spots are never without noise; encoders are judged once aligned.
    """
    found: list[StreamFinding] = []
    out: dict[str, StreamDevice] = {}
    for name, device in devices.items():
        moving = devices["command"].track if name == "joints" and "command" in devices else None
        faults = breaks(device.track, device.sequence, moving, noisy=name == "spots")
        track_faults, out[name] = judged(device, faults)
        found += break_findings(device.track, track_faults)
    return found, out


def _answering(devices: dict[str, StreamDevice]) -> tuple[dict[str, StreamDevice], dict[int, str]]:
    """Without the second encoders that hardly answer, and joint -> how often: a row counts only as a whole."""
    encoders = devices.get("encoders")
    if encoders is None:
        return devices, {}
    track = encoders.track
    read = np.isfinite(track.values).sum(axis=0)
    answers = read >= limits.ANSWERS_SHARE * read.max(initial=0)
    if answers.all():
        return devices, {}
    rows = len(track.values)
    silent = {track.joint(int(c)): f"read in {read[c]} of {rows} rows" for c in np.flatnonzero(~answers)}
    left = replace(encoders, track=track.of(np.flatnonzero(answers).tolist()))
    return {**devices, "encoders": left}, silent


def _without_reading(devices: Mapping[str, StreamDevice]) -> dict[int, str]:
    joints, encoders = devices.get("joints"), devices.get("encoders")
    if joints is None or encoders is None:
        return {}
    there = {encoders.track.joint(c) for c in range(encoders.track.channels)}
    rows = len(encoders.track.time_s)
    return {j: f"read in 0 of {rows} rows" for j in range(1, joints.track.channels + 1) if j not in there}


@dataclass(frozen=True, eq=False)
class _Second:
    """What the second encoders show; `judged` (channel,): whether slips were sought there."""

    clock: ClockFit
    findings: list[StreamFinding]
    bent: tuple[Deflection, ...] = ()
    judged: tuple[bool, ...] = ()
    offsets: tuple[AngleOffset, ...] = ()


def _encoders(
    joints: StreamDevice,
    encoders: StreamDevice,
    stands: tuple[Stand, ...],
    causes: Causes | None,
    torque: StreamDevice | None,
    levers: GravityLevers | None,
    zeros_rad: Sequence[float | None],
) -> _Second:
    if encoders.track.joints:  # `causes` and `levers` ask for the angles of all joints
        joints = replace(joints, track=joints.track.of([j - 1 for j in encoders.track.joints]))
        causes, levers = None, None
    fit = clock_between(joints.track, encoders.track, start_between(joints, encoders))
    if fit.offset_s is None:
        return _by_stamps(joints, encoders, stands, causes) if shares_host_clock(encoders) else _Second(fit, [])
    lags = following(joints.track, _moved(encoders.track, fit))
    alike = _alike(lags)
    if len(alike) >= limits.LAGGING_TOGETHER and any(one.outcome is Outcome.FOUND for one in lags):
        # one late joint pulls the common clock: what most joints share is the clock, the rest is that joint's own
        again = clock_between(joints.track.of(alike), encoders.track.of(alike), start_between(joints, encoders))
        fit = fit if again.offset_s is None else again
        lags = following(joints.track, _moved(encoders.track, fit))
    at_joints = _moved(encoders.track, fit)
    bent = () if torque is None else deflections(at_joints, joints.track, _on_clock_of(joints, torque))
    friction = {one.joint for one in bent if one.friction_may_lag}
    found = [reading_lag_finding(one) for one in lags if one.outcome is Outcome.FOUND and one.joint not in friction]
    found += [deflection_finding(one) for one in bent if one.outcome is Outcome.FOUND]
    slipped = slips(at_joints, joints.track, stands, causes)
    found += [slip_finding(one) for one in slipped.found]
    frozen = [one for one in breaks(at_joints, None, _behind(joints.track, lags)) if one.fault is Fault.FROZEN]
    found += break_findings(at_joints, frozen) + _rings(at_joints, stands)
    own_zeros = [
        zeros_rad[j] if j < len(zeros_rad) else None
        for j in (at_joints.joint(c) - 1 for c in range(at_joints.channels))
    ]
    offsets = angle_offsets(at_joints, joints.track, levers, zeros_rad=own_zeros, wraps=True)
    return _Second(fit, found, bent, slipped.judged, _without_known(offsets, slipped, bent))


def _without_known(
    offsets: tuple[AngleOffset, ...], slipped: Slips, bent: tuple[Deflection, ...]
) -> tuple[AngleOffset, ...]:
    """Without changes that are slips, and without droops that a measured torque explains or that discs have."""
    stepped = {one.joint for one in slipped.found}
    soft = {one.joint for one in bent if one.outcome is Outcome.FOUND}
    return tuple(one.known(stepped=one.joint in stepped, bent=one.joint in soft) for one in offsets)


def _behind(track: Track, lags: Sequence[Following]) -> Track:
    """As late in each channel as its reading: what has not moved yet is not frozen."""
    values = track.values.copy()
    for channel, one in enumerate(lags):
        if one.outcome is Outcome.FOUND and one.behind_s is not None:
            later = track.curve.at(track.time_s - one.behind_s)[:, channel]
            values[:, channel] = np.where(np.isfinite(later), later, values[:, channel])
    return replace(track, values=values)


def _by_stamps(
    joints: StreamDevice, encoders: StreamDevice, stands: tuple[Stand, ...], causes: Causes | None
) -> _Second:
    """A host that runs at no even pace beside the joints leads to their clock piece by piece, to some milliseconds.

    That is enough for what stays from stand to stand, and for nothing that is a matter of time.
    """
    at_s = np.interp(encoders.track.time_s, np.maximum.accumulate(joints.host_s), joints.track.time_s)
    track = replace(encoders.track, time_s=at_s)
    fit = clock_between(joints.track, track, Ticks(0.0))
    if fit.offset_s is None:
        return _Second(fit, [])
    found = slips(_moved(track, fit), joints.track, stands, causes)
    return _Second(ClockFit(ClockStatus.UNEVEN), [slip_finding(one) for one in found.found], judged=found.judged)


def _alike(lags: Sequence[Following]) -> list[int]:
    """Channels as late as most of those that moved."""
    behind = {channel: one.behind_s for channel, one in enumerate(lags) if one.behind_s is not None}
    if not behind:
        return []
    usual = float(np.median(list(behind.values())))
    scatter = SIGMA_OF_MEDIAN * float(np.median([abs(b - usual) for b in behind.values()]))
    return [c for c, b in behind.items() if abs(b - usual) <= max(3.0 * scatter, limits.BEHIND_S)]


@dataclass(frozen=True, eq=False)
class _Spots:
    """The spots on the clock of the joints: by the motion where a model has it, else by the host's stamps."""

    track: Track
    clock: ClockFit | None
    findings: list[StreamFinding]


def _spots(joints: StreamDevice, spots: StreamDevice, stands: tuple[Stand, ...], predicted: Predicted | None) -> _Spots:
    by_stamps = replace(spots.track, time_s=by_host(spots.track.time_s, spots, joints))
    if predicted is None:
        return _Spots(by_stamps, None, [])
    track = joints.track.read()
    model = Track("predicted spots", "m", track.time_s, predicted(track.values, track.time_s))
    fit = clock_between(model, spots.track, start_between(joints, spots))
    at_joints = _moved(spots.track, fit) if fit.offset_s is not None else by_stamps
    rings = ringing(at_joints, stands, levers_of(track, predicted), limits.SERVO_S)
    return _Spots(at_joints, fit, [ringing_finding(at_joints, rings)] if rings.stops else [])


def _unsettled(
    spots: StreamDevice, seen: _Spots, windows: Sequence[Window] | None, stands: tuple[Stand, ...], joints: int
) -> list[StreamFinding]:
    """Windows move with the spots, so the samples in them stay the same whatever the clocks."""
    if not windows:
        return []
    from_s, to_s = (
        np.interp(np.array(at), spots.track.time_s, seen.track.time_s)
        for at in ([w.from_s for w in windows], [w.to_s for w in windows])
    )
    moved = [Window(float(a), float(b)) for a, b in zip(from_s, to_s, strict=True)]
    each = unsettled(seen.track, moved, stands)
    if not any(one.outcome is Outcome.FOUND for one in each):
        return []
    return [unsettled_finding(seen.track, moved, each, joints)]


def levers_of(joints: Track, predicted: Predicted) -> Levers:
    """What a turn of each joint does to the spots, by differences of the model."""
    curve = joints.curve

    def levers(time_s: float) -> Floats:
        q = curve.at(np.array([time_s]))
        n = q.shape[1]
        nudged = np.repeat(q, 2 * n, axis=0) + NUDGE_RAD * np.concatenate([np.eye(n), -np.eye(n)])
        spots = predicted(nudged, np.full(2 * n, time_s))
        return np.nan_to_num((spots[:n] - spots[n:]).T / (2.0 * NUDGE_RAD))

    return levers


def _on_clock_of(joints: StreamDevice, other: StreamDevice) -> Track:
    """As it stands where both were stamped together, else by the host's stamps."""
    if np.array_equal(joints.track.time_s, other.track.time_s):
        return other.track
    return replace(other.track, time_s=by_host(other.track.time_s, other, joints))


def _moved(track: Track, fit: ClockFit) -> Track:
    return replace(track, time_s=fit.to_reference(track.time_s))


def _rings(track: Track, stands: tuple[Stand, ...]) -> list[StreamFinding]:
    """Of angles: every joint turns its own reading only."""
    rings = ringing(track, stands, lambda _: np.eye(track.channels), limits.SERVO_S)
    if not rings.stops:
        return []
    joint = None if rings.joint is None else track.joint(rings.joint - 1)
    rivals = tuple(track.joint(one - 1) for one in rings.rivals)
    return [ringing_finding(track, replace(rings, joint=joint, rivals=rivals))]
