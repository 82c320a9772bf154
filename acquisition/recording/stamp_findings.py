"""Whether the time stamps of streams are what they state: bursts, batches, steps of a clock, a wrong mean rate.

Judged is the time that a computation uses: the device's where there is one, else the host's.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from acquisition.recording.can_frames import is_frames
from acquisition.recording.recording import Recording, Stream
from acquisition.recording.samples import Floats
from acquisition.recording.sampling import SIGMA_OF_MEDIAN, Sampling, SamplingStatus, closeness, sampling_of

BURSTY_SHARE = 0.4  # of rows that come far too soon: half of them where two come together
FEWEST_BURSTS = 5
EVEN_SHARE = 0.8  # of the batches that have the same number of rows
RATE_OFF = 5e-3  # fifty times a poor quartz
OTHER_RATE = 0.1  # beyond, it was set to another rate on purpose
SIGMAS = 5.0
SLEPT = 0.9  # of the time that missing numbers take, by which the clock fell behind
SAME_S = 1.0  # no clock of a device shows the host's time so closely; a driver stamped for it
PACE = 0.01  # host seconds in one of a device; beyond, emulators ran at another pace than real time


@dataclass(frozen=True)
class Bursts:
    """Arrivals in groups: rows far too soon after the one before, the pause between groups, the usual group."""

    share: float
    within_s: float  # 95 % of the close rows follow the one before within this
    pause_s: float
    pause_sigma_s: float  # of the median
    rows: int | None  # of every batch; None: they differ


@dataclass(frozen=True, eq=False)
class StampJudgement:
    """What the times of one stream show."""

    bursts: Bursts | None
    sampling: Sampling

    @property
    def restorable(self) -> bool:
        """Whether something is wrong that a constant period behind it may mend."""
        return self.bursts is not None or bool(self.sampling.steps)


def used_times(stream: Stream) -> Floats:
    """(sample,) s: the device's time where every sample has one, else that of arrival."""
    return stream.device_s if np.all(np.isfinite(stream.device_s)) else stream.host_s


def judge_stamps(stream: Stream) -> StampJudgement:
    """Of one stream with rows."""
    time_s = used_times(stream)
    return StampJudgement(_bursts(time_s, stream), sampling_of(time_s, stream.sequence))


def stamp_findings(recording: Recording) -> Iterator[tuple[str, str, str]]:
    """Kind ("bursts", "clock-step", "rate"), stream, and a sentence with size, sigma and remedy. Frames of a bus: none.

    A log of CAN frames is left out: frames follow one another on a bus as they like.
    """
    streams = {name: s for name, s in recording.streams.items() if s.host_s.size and not is_frames(s)}
    judged = {name: judge_stamps(stream) for name, stream in streams.items()}
    for name, one in judged.items():
        stream = streams[name]
        if one.bursts is not None:
            yield "bursts", name, _bursts_say(one.bursts, one.sampling, stream)
        for step in one.sampling.steps:
            yield "clock-step", name, _step_says(recording, stream, one.sampling, step.row)
    yield from _against_nominal(recording, streams, judged)
    yield from _against_each_other(streams)


def _bursts(time_s: Floats, stream: Stream) -> Bursts | None:
    if time_s.size < 4 * FEWEST_BURSTS:
        return None
    _, close = closeness(time_s, stream.sequence)
    share, between_s = float(np.mean(close)), np.diff(time_s)
    pauses_s = between_s[~close]
    if share < BURSTY_SHARE or pauses_s.size < FEWEST_BURSTS:
        return None
    sizes = np.diff(np.flatnonzero(~close))
    usual = int(np.median(sizes))
    pause_s = float(np.median(pauses_s))
    scatter_s = SIGMA_OF_MEDIAN * float(np.median(np.abs(pauses_s - pause_s)))
    return Bursts(
        share,
        float(np.quantile(between_s[close], 0.95)),
        pause_s,
        1.2533 * scatter_s / float(np.sqrt(pauses_s.size)),  # of a median of normal numbers
        usual if np.mean(sizes == usual) >= EVEN_SHARE else None,
    )


def _bursts_say(bursts: Bursts, sampling: Sampling, stream: Stream) -> str:
    how = (
        f"samples arrive in batches of {bursts.rows} with nearly one stamp"
        if bursts.rows is not None and bursts.rows > 1
        else "samples arrive in bursts"
    )
    stated = "" if stream.stamps in ("arrived", "unknown") else f"the stamps are stated as `{stream.stamps}`, but "
    size = (
        f"{100.0 * bursts.share:.0f} % of them within {_ms(bursts.within_s)} of the one before, then a pause of "
        f"{_ms(bursts.pause_s, bursts.pause_sigma_s)}; no constant delay repairs this"
    )
    if sampling.status is SamplingStatus.REGULAR:
        remedy = (
            f"sampling behind them is regular, period {period_text(sampling)}: restore the times with "
            "calibeam import --restore-stamps, or record the device's own stamp"
        )
    else:
        remedy = f"not restorable: {sampling.status.value}; record the device's own stamp"
    return f"{stated}{how}, {size}; {remedy}"


def _step_says(recording: Recording, stream: Stream, sampling: Sampling, row: int) -> str:
    step = next(one for one in sampling.steps if one.row == row)
    at = f"at {used_times(stream)[row] - used_times(stream)[0]:.3f} s of the stream (sample {row + 1})"
    period_s = sampling.period_s or 0.0
    size = _ms(abs(step.size_s), step.sigma_s)
    if step.size_s < 0.0 and step.skipped and -step.size_s > SLEPT * step.skipped * period_s:
        return (
            f"the clock of the stamps slept: it fell behind by {size} {at}, where {step.skipped} samples are missing; "
            "restore the times with calibeam import --restore-stamps, and keep the computer from suspending"
        )
    samples = step.size_s / period_s
    if step.size_s > 0.0 and not counts(stream) and abs(samples - round(samples)) * period_s < SIGMAS * step.sigma_s:
        return (
            f"the time steps forward by {size} {at}: {round(samples)} samples were lost without a counter, or the "
            "clock was set; record with a counter, and with a clock that nothing sets"
        )
    way = "forward" if step.size_s > 0.0 else "back"
    return (
        f"the clock of the stamps was set {way} by {size} {at}, as NTP does; restore the times with calibeam import "
        "--restore-stamps, and let NTP only slew during a session, or record the device's own stamp"
    )


def counts(stream: Stream) -> bool:
    """Whether its sequence numbers are known to count what was lost; of a table they number the rows."""
    return bool(np.any(np.diff(stream.sequence) > 1))


def _against_nominal(
    recording: Recording, streams: Mapping[str, Stream], judged: Mapping[str, StampJudgement]
) -> Iterator[tuple[str, str, str]]:
    """Where the rig file states a rate, and the device keeps it by itself: neither polled nor triggered."""
    devices = recording.rig.devices
    tracker = devices.tracker if devices.tracker is None or not devices.tracker.trigger else None
    stated = {"psd": devices.psd, "robot": devices.robot, "tracker": tracker}
    paced = any(abs(rate - 1.0) > PACE for rate in _rates(streams).values())
    for name, one in judged.items():
        device, stream, sampling = stated.get(name), streams[name], one.sampling
        if device is None or sampling.period_s is None or sampling.sigma_s is None or stream.stamps == "sent":
            continue
        if paced and used_times(stream) is stream.host_s:
            continue
        off, sigma = 1.0 / (sampling.period_s * device.rate_hz) - 1.0, sampling.sigma_s / sampling.period_s
        if RATE_OFF < abs(off) < OTHER_RATE and abs(off) > SIGMAS * sigma:
            yield (
                "rate",
                name,
                f"mean rate {_percent(off, sigma)} off the {device.rate_hz:g} a second of the rig file (period "
                f"{period_text(sampling)}): the clock of the stamps or the device runs at a wrong pace; correct "
                f"rate_hz in [devices.{name}], or the clock",
            )


def _rates(streams: Mapping[str, Stream]) -> dict[str, float]:
    """Seconds of arrival in one second of the device, of streams that have both."""
    out: dict[str, float] = {}
    for name, stream in streams.items():
        late_s = stream.host_s - used_times(stream)
        by_host = stream.stamps in ("sent", "arrived", "restored") or np.all(late_s == 0.0)
        by_host = by_host or (stream.stamps == "unknown" and late_s.min() >= 0.0 and late_s.max() < SAME_S)
        if not by_host and np.ptp(stream.device_s) > 0.0:
            out[name] = float(np.ptp(stream.host_s) / np.ptp(stream.device_s))
    return out


def _against_each_other(streams: Mapping[str, Stream]) -> Iterator[tuple[str, str, str]]:
    """Clocks of two devices over the time of arrival that they share: an emulation's pace is the same for both."""
    for one, other in combinations(_rates(streams), 2):
        a, b = streams[one], streams[other]
        if any(np.any(np.diff(times) < 0.0) for s in (a, b) for times in (s.device_s, s.host_s)):
            continue
        from_s, to_s = max(a.host_s[0], b.host_s[0]), min(a.host_s[-1], b.host_s[-1])
        if to_s - from_s < 1.0:
            continue
        grid_s = np.linspace(from_s, to_s, 21)[1:-1]
        own, its = (np.interp(grid_s, s.host_s, s.device_s) for s in (a, b))
        paces = np.diff(own)[np.diff(its) > 0.0] / np.diff(its)[np.diff(its) > 0.0]
        if paces.size < 10:
            continue
        off = float(np.ptp(own) / np.ptp(its)) - 1.0
        sigma = float(np.std(paces)) / float(np.sqrt(paces.size))
        if abs(off) > max(RATE_OFF, SIGMAS * sigma):
            yield (
                "rate",
                one,
                f"its clock runs {_percent(off, sigma)} off the clock of stream {other}: one of the two is wrong; "
                "compare both with the host's clock above, and have the device repaired or state its true rate",
            )


def period_text(sampling: Sampling) -> str:
    """Period with sigma; an empty text without one."""
    return "" if sampling.period_s is None else _ms(sampling.period_s, sampling.sigma_s)


def _ms(seconds: float, sigma_s: float | None = None) -> str:
    if not sigma_s:
        return f"{1e3 * seconds:.3g} ms"
    digits = max(0, min(9, 1 - int(np.floor(np.log10(1e3 * sigma_s)))))
    return f"{1e3 * seconds:.{digits}f} ± {1e3 * sigma_s:.{digits}f} ms"


def _percent(off: float, sigma: float) -> str:
    digits = max(1, min(6, 1 - int(np.floor(np.log10(max(100.0 * sigma, 1e-5))))))
    return f"{100.0 * off:+.{digits}f} ± {100.0 * sigma:.{digits}f} %"
