"""Times of regular sampling in place of stamps that came in bursts, or from a clock that was set.

The number of a sample and the period behind the stamps give its time, but for a constant: how late the promptest sample
arrived is in no stamp. Streams whose stamps are as they should be stay as they are, and so does the time of arrival.
"""

from dataclasses import replace

from acquisition.recording.can_frames import is_frames
from acquisition.recording.errors import RecordingError
from acquisition.recording.recording import Recording, Stream
from acquisition.recording.sampling import Sampling, SamplingStatus
from acquisition.recording.stamp_findings import counts, judge_stamps, period_text

NOTE = "restored_stamps_"  # and the name of the stream


def restored_stamps(source: Recording) -> Recording:
    """The recording with `device_s` restored in s, and a note of each restored stream; the source is not changed.

    RecordingError where no stream needs it, or where the samples of one that does have no period, or may be incomplete.
    """
    streams, notes = dict(source.streams), dict(source.notes)
    for name, stream in source.streams.items():
        if is_frames(stream) or not stream.host_s.size:
            continue
        judged = judge_stamps(stream)
        if not judged.restorable:
            continue
        why = _why_not(stream, judged.sampling)
        if why is not None:
            raise RecordingError(f"{source.path}: stream {name}: its time stamps cannot be restored: {why}")
        streams[name], notes[NOTE + name] = _restored(stream, judged.sampling)
    if len(notes) == len(source.notes):
        raise RecordingError(
            f"{source.path}: no stream has stamps in bursts or a clock that was set: there is nothing to restore; "
            "leave --restore-stamps out"
        )
    return replace(source, streams=streams, notes=notes)


def _why_not(stream: Stream, sampling: Sampling) -> str | None:
    """The reason against it, with the remedy. None: nothing is against it."""
    if sampling.status is not SamplingStatus.REGULAR:
        return f"{sampling.status.value}; record the device's own stamp"
    forward = next((step for step in sampling.steps if step.size_s > 0.0), None)
    if forward is None or counts(stream):
        return None
    return (
        f"before sample {forward.row + 1} the time steps forward by {1e3 * forward.size_s:.1f} ms, "
        f"{forward.size_s / (sampling.period_s or 1.0):.1f} periods; without a counter, samples that were lost and a "
        "clock that was set look the same: import the parts before and after by themselves, or record a column "
        "'sequence' that counts the samples"
    )


def _restored(stream: Stream, sampling: Sampling) -> tuple[Stream, str]:
    """ValueError where the sampling has no period."""
    if sampling.period_s is None or sampling.sigma_s is None or sampling.start_s is None:
        raise ValueError(f"stream {stream.name}: no period ({sampling.status.value})")
    number = (stream.sequence - stream.sequence[0]).astype(float)
    steps = f", without {len(sampling.steps)} steps of the clock" if sampling.steps else ""
    reach_s = 0.5 * float(number[-1]) * sampling.sigma_s
    note = (
        f"period {period_text(sampling)} (1 sigma), from the least delayed of stamps that were "
        f"'{stream.stamps}'{steps}; relative to the middle of the stream times are uncertain by up to "
        f"{1e3 * reach_s:.2g} ms (1 sigma); the delay of the promptest sample, a constant, is unknown and left in"
    )
    return replace(stream, device_s=sampling.start_s + sampling.period_s * number, stamps="restored"), note
