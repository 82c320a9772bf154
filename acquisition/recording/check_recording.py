"""What is wrong with a recording, as data: gaps, times that do not rise, saturation, silence, a file cut short."""

import enum
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from acquisition.recording.can_frames import CHANNELS_NOTE, FLAGS, FrameFlag, is_frames
from acquisition.recording.mcap.layout import SEGMENT_NOTE
from acquisition.recording.recording import Recording, Stream
from acquisition.recording.samples import Floats

LOG_NOTES = (SEGMENT_NOTE, CHANNELS_NOTE)


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


@dataclass(frozen=True)
class Finding:
    """One problem: its kind, where it is ("stream psd", "samples", "file"), and a sentence for a person."""

    problem: Problem
    where: str
    says: str


def check(recording: Recording) -> tuple[Finding, ...]:
    """Everything found, the file first, then stream by stream, then the samples; empty when all is well."""
    return (*_file(recording), *_streams(recording), *_samples(recording))


def _file(recording: Recording) -> Iterator[Finding]:
    for damage in recording.damage:
        yield Finding(Problem.DAMAGED, "file", damage)
    if not recording.complete:
        yield Finding(
            Problem.INCOMPLETE, "file", "the session was cut short or its end is missing; what is here is good"
        )


def _streams(recording: Recording) -> Iterator[Finding]:
    for stream in recording.streams.values():
        where = f"stream {stream.name}"
        if stream.host_s.size == 0:
            yield Finding(Problem.SILENT, where, "declared, but not one sample came")
            continue
        for gap in stream.gaps:
            count = "an unknown number of" if gap.missing < 0 else str(gap.missing)
            between = f"between {_since(recording, gap.from_s)} and {_since(recording, gap.to_s)}"
            yield Finding(Problem.GAP, where, f"{count} samples missing {between}: {gap.reason}")
        yield from _device_times(where, stream)
        yield from _order(where, "host_s", stream.host_s)
        yield from _saturation(recording, where, stream)
        yield from _error_frames(where, stream)


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
        yield Finding(Problem.ERROR_FRAMES, where, f"{count} error frames; check termination, bit rate and cables")


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
    """Whether it was recorded, or imported, without a session: then nobody expects settled samples in it."""
    return any(note in recording.notes for note in LOG_NOTES)


def _since(recording: Recording, host_s: float) -> str:
    return f"{host_s - recording.host_s0:.3f} s"
