"""What is wrong with a recording, as data: gaps, times that do not rise, saturation, silence, a file cut short."""

import enum
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from acquisition.recording.can_frames import CHANNELS_NOTE, FLAGS, FrameFlag, is_frames
from acquisition.recording.mcap.layout import MOTION_NOTE, READINGS_NOTE, SEGMENT_NOTE, STREAMS_NOTE
from acquisition.recording.recording import Recording, Stream
from acquisition.recording.samples import Floats
from acquisition.recording.stamp_findings import stamp_findings

LOG_NOTES = (SEGMENT_NOTE, CHANNELS_NOTE, STREAMS_NOTE, MOTION_NOTE)


class Problem(enum.Enum):
    """Kinds of findings."""

    INCOMPLETE = "incomplete"
    DAMAGED = "damaged"
    SILENT = "silent"
    GAP = "gap"
    TIME_ORDER = "time-order"
    DUPLICATE_TIME = "duplicate-time"
    NO_SAMPLES = "no-samples"
    SATURATED = "saturated"
    ERROR_FRAMES = "error-frames"
    READINGS = "readings-left-out"
    BURSTS = "bursts"
    CLOCK_STEP = "clock-step"
    RATE = "rate"
    CONTROLLER_ARM = "controller-arm"  # computed by whoever has the kinematics: calibrate/fit/controller_arm.py


class Severity(enum.Enum):
    """What a finding means for whoever computes with the recording."""

    ERROR = "error"  # something that was measured is lost, or stamped wrongly
    WARNING = "warning"  # usable; what is named should be looked at before the next session
    INFORMATION = "information"  # ordinary: it costs nothing


@dataclass(frozen=True)
class Finding:
    """One problem: its kind, where it is ("stream psd", "samples", "file"), a sentence for a person, its weight."""

    problem: Problem
    where: str
    says: str
    severity: Severity = Severity.ERROR

    @property
    def is_error(self) -> bool:
        return self.severity is Severity.ERROR


NO_READING, NO_ANSWER = "no_reading", 1  # channel of encoders; its value where nothing came for the row
LEFT_OUT = {2: "out of the range that the signal states", 3: "faster than a joint turns"}
USUAL_SHARE = 0.02  # of a stream's samples may be missing without a word: settled samples average over those that came
USUAL_GAP = 50  # samples in one gap: half a second of encoders asked every 10 ms


def check(recording: Recording) -> tuple[Finding, ...]:
    """Everything found: errors, warnings, information; of each the file, streams, then samples. Empty: all is well."""
    stamps = [
        Finding(Problem(kind), f"stream {name}", says, Severity.WARNING)
        for kind, name, says in stamp_findings(recording)
    ]
    in_bursts = {finding.where for finding in stamps if finding.problem is Problem.BURSTS}
    streams = [  # one stamp for a whole batch is no sample that came twice
        one for one in _streams(recording) if one.problem is not Problem.DUPLICATE_TIME or one.where not in in_bursts
    ]
    found = (*_file(recording), *streams, *stamps, *_samples(recording))
    return tuple(sorted(found, key=lambda finding: list(Severity).index(finding.severity)))


def _file(recording: Recording) -> Iterator[Finding]:
    for damage in recording.damage:
        yield Finding(Problem.DAMAGED, "file", damage)
    for line in recording.notes.get(READINGS_NOTE, "").splitlines():
        yield Finding(Problem.READINGS, "file", line, Severity.WARNING)
    if not recording.complete:
        yield Finding(
            Problem.INCOMPLETE,
            "file",
            "the session was cut short or its end is missing; what is here is good",
            Severity.ERROR if recording.damage else Severity.WARNING,
        )


def _streams(recording: Recording) -> Iterator[Finding]:
    for stream in recording.streams.values():
        where = f"stream {stream.name}"
        if stream.host_s.size == 0:
            yield Finding(Problem.SILENT, where, "declared, but not one sample came")
            continue
        yield from _gaps(recording, where, stream)
        yield from _device_times(where, stream)
        yield from _order(where, "host_s", stream.host_s)
        yield from _saturation(recording, where, stream)
        yield from _error_frames(where, stream)
        yield from (Finding(Problem.READINGS, where, says, Severity.WARNING) for says in left_out(stream))


def _gaps(recording: Recording, where: str, stream: Stream) -> Iterator[Finding]:
    """One finding for all gaps of a stream: how much is missing, and the longest gap."""
    if not stream.gaps:
        return
    longest = max(stream.gaps, key=lambda gap: gap.missing if gap.missing >= 0 else USUAL_GAP + 1)
    counted, unknown = sum(max(gap.missing, 0) for gap in stream.gaps), any(gap.missing < 0 for gap in stream.gaps)
    share = counted / (counted + stream.host_s.size)
    between = f"between {_since(recording, longest.from_s)} and {_since(recording, longest.to_s)}: {longest.reason}"
    count = f"{'at least ' if unknown else ''}{counted} samples missing ({100.0 * share:.2g} %)"
    if len(stream.gaps) == 1:
        says = f"{count} {between}"
    else:
        most = "an unknown number" if longest.missing < 0 else str(longest.missing)
        first = min(stream.gaps, key=lambda gap: gap.from_s)
        says = f"{count} in {len(stream.gaps)} gaps from {_since(recording, first.from_s)} on, {most} of them {between}"
    usual = not unknown and share <= USUAL_SHARE and longest.missing <= USUAL_GAP
    yield Finding(Problem.GAP, where, says, Severity.INFORMATION if usual else Severity.WARNING)


def _saturation(recording: Recording, where: str, stream: Stream) -> Iterator[Finding]:
    for channel in stream.channels:
        values = np.abs(stream.values[channel.name].reshape(stream.host_s.size, -1))
        at = np.flatnonzero((values >= channel.full_scale).any(axis=1))
        if at.size:
            share = f"{at.size} of {stream.host_s.size} samples"
            first = f"first at {_since(recording, float(stream.host_s[at[0]]))}"
            limit = f"{channel.full_scale:.6g} {channel.unit}".rstrip()
            yield Finding(Problem.SATURATED, where, f"{channel.name} at its full scale, {limit}, in {share}, {first}")


def _error_frames(where: str, stream: Stream) -> Iterator[Finding]:
    if not is_frames(stream):
        return
    count = int(np.count_nonzero(stream.values[FLAGS].astype(np.int64) & FrameFlag.ERROR))
    if count:
        yield Finding(
            Problem.ERROR_FRAMES,
            where,
            f"{count} error frames; check termination, bit rate and cables",
            Severity.WARNING,
        )


def left_out(stream: Stream) -> Iterator[str]:
    """Of each encoder of which readings came and were not taken: in how many rows, and why."""
    codes = stream.values.get(NO_READING)
    if codes is None:
        return
    for number, column in enumerate(codes.reshape(len(codes), -1).astype(np.int64).T, start=1):
        counts = {why: int(np.count_nonzero(column == code)) for code, why in LEFT_OUT.items()}
        if any(counts.values()):
            whys = ", ".join(f"{why} in {count}" for why, count in counts.items() if count)
            yield f"encoder {number}: readings left out of {len(column)} rows: {whys}; check its signal and its wiring"


def _device_times(where: str, stream: Stream) -> Iterator[Finding]:
    yield from _order(where, "device_s", stream.device_s)
    repeats = int(np.count_nonzero(np.diff(stream.device_s) == 0.0))
    if repeats and not is_frames(stream):  # adapters with coarse stamps give several frames the same one
        yield Finding(Problem.DUPLICATE_TIME, where, f"device_s repeats {repeats} times: samples came twice")


def _order(where: str, name: str, times_s: Floats) -> Iterator[Finding]:
    back = np.flatnonzero(np.diff(times_s) < 0.0)
    if back.size:
        at = int(back[0])
        says = f"{name} goes back {back.size} times, first from {times_s[at]:.6f} to {times_s[at + 1]:.6f} s"
        yield Finding(Problem.TIME_ORDER, where, says)


def _samples(recording: Recording) -> Iterator[Finding]:
    times_s = recording.samples.column("t_s")
    if times_s.size == 0 and not is_log(recording):
        yield Finding(Problem.NO_SAMPLES, "samples", "not one settled sample was taken")
    yield from _order("samples", "t_s", times_s)
    repeats = int(np.count_nonzero(np.diff(times_s) == 0.0))
    if repeats:
        yield Finding(Problem.DUPLICATE_TIME, "samples", f"t_s repeats {repeats} times in consecutive rows")


def is_log(recording: Recording) -> bool:
    """Whether it was recorded, or imported, without poses to settle at: nobody expects settled samples in it."""
    return recording.rig.n_joints == 0 or any(note in recording.notes for note in LOG_NOTES)


def _since(recording: Recording, host_s: float) -> str:
    return f"{host_s - recording.host_s0:.3f} s"
