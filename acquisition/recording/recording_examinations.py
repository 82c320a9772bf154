"""What `check` examines of a recording itself, and how each examination ended: samples, streams, stamps, readings.

A new examination is one function here and one line in RECORDING_EXAMINATIONS.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from acquisition.recording.can_frames import is_frames
from acquisition.recording.check_recording import Finding, Problem, Severity, is_log
from acquisition.recording.examination import NO_REMEDY, Examination, ExaminationRecord
from acquisition.recording.recording import Recording, Stream
from acquisition.recording.sampling import STEP_S, STEP_SIGMAS, SamplingStatus
from acquisition.recording.stamp_findings import BURSTY_SHARE, judge_stamps

Records = Iterator[ExaminationRecord]
POSITION = "position_rad"  # channel of encoders
FEWEST_ROWS = 3
MOST_MISSING = 0.5  # share of the readings


@dataclass(frozen=True, eq=False)
class Checked:
    """A recording, and what the check of it has found."""

    recording: Recording
    findings: tuple[Finding, ...]

    def sentences(self, where: str, *problems: Problem) -> str:
        """Errors and warnings of these kinds at one place; empty: none."""
        serious = (f for f in self.findings if f.severity is not Severity.INFORMATION or f.problem is Problem.GAP)
        return "; ".join(f.says for f in serious if f.where == where and (not problems or f.problem in problems))


SAMPLES = Examination("order of the samples", ("t_s",), "record two settled samples or more, with their times")
STREAMS = Examination(
    "gaps and order of the streams",
    ("host_s", "device_s", "sequence"),
    "record three rows or more, with stamps or a counter that rise",
)
STAMPS = Examination(
    "time stamps", ("device_s", "host_s"), "record some hundred rows at a regular rate, with stamps that rise"
)
READINGS = Examination(
    "readings of the encoders",
    (POSITION,),
    "record encoders that answer: check wiring, nodes and the signals of the DBC",
)
IN_STREAMS = (Problem.SILENT, Problem.GAP, Problem.TIME_ORDER, Problem.DUPLICATE_TIME, Problem.SATURATED)


def _samples(checked: Checked) -> Records:
    times_s, log = checked.recording.samples.column("t_s"), is_log(checked.recording)
    found = checked.sentences("samples")
    if found:
        yield SAMPLES.found(found)
    elif log and not len(times_s):
        yield SAMPLES.not_examined("a log has no settled samples", expected=False, remedy=NO_REMEDY)
    elif np.isfinite(times_s).sum() < 2 or not np.ptp(times_s[np.isfinite(times_s)]) > 0.0:
        yield SAMPLES.not_examined(f"{len(times_s)} settled samples with times that rise")
    else:
        yield SAMPLES.nothing(1.0, "sample twice or out of order")


def _streams(checked: Checked) -> Records:
    streams = checked.recording.streams.values()
    if not streams:
        yield STREAMS.not_examined("no stream was recorded", expected=is_log(checked.recording))
    for stream in streams:
        where = f"stream {stream.name}"
        found = checked.sentences(where, *IN_STREAMS)
        if found:
            yield STREAMS.found(found, where)
        elif why := _unusable(stream):
            yield STREAMS.not_examined(why, where)
        else:
            yield STREAMS.nothing(1.0, "missing row", where)


def _unusable(stream: Stream) -> str:
    """Why the order of its rows shows nothing; empty: it does."""
    if len(stream.host_s) < FEWEST_ROWS:
        return f"only {len(stream.host_s)} rows"
    times = (stream.device_s, stream.host_s)
    if not any(np.isfinite(t).all() and np.ptp(t) > 0.0 for t in times):
        return "its stamps do not rise"
    return "" if np.ptp(stream.sequence) > 0 else "its counter does not rise"


def _stamps(checked: Checked) -> Records:
    streams = [s for s in checked.recording.streams.values() if not is_frames(s)]
    if not streams:
        yield STAMPS.not_examined("no stream of a regular rate was recorded", expected=False)
    for stream in streams:
        where = f"stream {stream.name}"
        found = checked.sentences(where, Problem.BURSTS, Problem.CLOCK_STEP, Problem.RATE)
        if found:
            yield STAMPS.found(found, where)
        elif why := _unusable(stream):
            yield STAMPS.not_examined(why, where)
        else:
            yield _of_sampling(stream, where)


def _of_sampling(stream: Stream, where: str) -> ExaminationRecord:
    """A step of the clock that is smaller than the scatter of the stamps would not be found."""
    sampling = judge_stamps(stream).sampling
    if sampling.status is SamplingStatus.REGULAR:
        return STAMPS.nothing(max(STEP_S, STEP_SIGMAS * sampling.scatter_s), "s", where)
    if sampling.status is SamplingStatus.IRREGULAR:
        return STAMPS.nothing(
            None, "", where, f"bursts of {100.0 * BURSTY_SHARE:.0f} % of the rows; no steps of a clock"
        )
    return STAMPS.not_examined(sampling.status.value, where)


def _readings(checked: Checked) -> Records:
    streams = [s for s in checked.recording.streams.values() if POSITION in s.values]
    if not streams:
        alone, why = checked.recording.rig.n_joints == 0, "no readings of encoders were recorded"
        expected = alone or (checked.recording.rig.devices.encoders is not None and is_log(checked.recording))
        yield READINGS.not_examined(why, expected=expected, remedy="" if expected else NO_REMEDY)
    for stream in streams:
        where = f"stream {stream.name}"
        values = stream.values[POSITION]
        values = values.reshape(len(values), int(np.prod(values.shape[1:])))  # also without one row
        found = checked.sentences(where, Problem.READINGS) or checked.sentences("file", Problem.READINGS)
        answers = np.isfinite(values).any(axis=0)
        if checked.recording.rig.n_joints == 0:  # else it is a joint without a second encoder
            silent = (np.flatnonzero(~answers) + 1 if answers.any() else np.array([], dtype=int)).tolist()
            yield from (READINGS.not_examined("not one valid reading came", f"encoder {k}") for k in silent)
        read = values[:, answers]
        missing = np.isnan(read)
        if found:
            yield READINGS.found(found, where)
        elif not missing.size or np.mean(missing) > MOST_MISSING:
            few = int(np.isfinite(values).sum())
            yield READINGS.not_examined(
                f"only {few} valid readings came" if few else "not one valid reading came", where
            )
        elif len(values) < FEWEST_ROWS:
            yield READINGS.not_examined(f"only {len(values)} rows", where)
        elif missing.any():
            yield READINGS.found(f"{int(missing.sum())} of {read.size} readings are missing", where)
        elif np.all(np.ptp(read, axis=0) == 0.0):
            yield READINGS.not_examined("no reading ever changes", where)
        else:
            yield READINGS.nothing(1.0, "missing reading", where)


RECORDING_EXAMINATIONS: tuple[tuple[Examination, Callable[[Checked], Records]], ...] = (
    (SAMPLES, _samples),
    (STREAMS, _streams),
    (STAMPS, _stamps),
    (READINGS, _readings),
)


def recording_examinations(recording: Recording, findings: tuple[Finding, ...]) -> tuple[ExaminationRecord, ...]:
    """The endings of all of them, in the order of the tuple."""
    checked = Checked(recording, findings)
    return tuple(record for _, examine in RECORDING_EXAMINATIONS for record in examine(checked))


def reading_examinations(recording: Recording, findings: tuple[Finding, ...]) -> tuple[ExaminationRecord, ...]:
    """Of the readings of encoders alone; none where the recording has none."""
    records = tuple(_readings(Checked(recording, findings)))
    return tuple(one for one in records if one.where)
