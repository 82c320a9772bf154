"""Samples missed, sent twice, frozen, or stamped backwards: what is wrong with a stream before any physics."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.track import Track, white_noise

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Fault(Enum):
    """What is wrong with a stretch of samples."""

    MISSED = "missing-samples"
    DUPLICATED = "duplicated-samples"
    BACKWARDS = "time-backwards"
    STEPPED = "clock-step"
    FROZEN = "frozen-reading"


@dataclass(frozen=True)
class Break:
    """`first` and `last` index the samples on both sides (missed, backwards) or of the run itself."""

    fault: Fault
    first: int
    last: int
    from_s: float
    to_s: float
    samples: int  # missed, repeated or frozen
    jump_s: float = 0.0  # of the clock, beyond one period
    channels: tuple[int, ...] = ()  # frozen ones; empty: all


def breaks(
    track: Track, sequence: Ints | None = None, moving: Track | None = None, *, noisy: bool = False
) -> tuple[Break, ...]:
    """In order of time. `sequence` (sample,) counts at the device.

    A reading that stands is separated from one that is frozen by `moving`, another reading of the same channels on the
    same clock, or because it is `noisy`: it never repeats itself, even when nothing moves. Without both nothing is
    reported.
    """
    found = [*_steps(track, sequence), *(_frozen(track, moving) if noisy or moving is not None else [])]
    return tuple(sorted(found, key=lambda one: one.first))


def _steps(track: Track, sequence: Ints | None) -> list[Break]:
    step_s = np.diff(track.time_s)
    rising = step_s[step_s > 0.0]
    usual_s = float(np.median(rising)) if len(rising) else 0.0
    same = np.all((track.values[1:] == track.values[:-1]) | np.isnan(track.values[1:]), axis=1)
    counted = None if sequence is None else np.diff(sequence)
    out: list[Break] = []
    for i in np.flatnonzero(_odd(step_s, usual_s, counted)):
        lost = round(float(step_s[i]) / usual_s) - 1 if counted is None and usual_s > 0.0 else 0
        lost = int(counted[i]) - 1 if counted is not None else lost
        if (counted is not None and counted[i] == 0) or (counted is None and step_s[i] == 0.0 and same[i]):
            fault, samples = Fault.DUPLICATED, 1
        elif step_s[i] <= 0.0 or lost < 0:
            fault, samples = Fault.BACKWARDS, 0
        elif counted is not None and counted[i] == 1:
            fault, samples = Fault.STEPPED, 0
        else:
            fault, samples = Fault.MISSED, lost
        if fault is not Fault.MISSED or samples > 0:
            at = int(i)
            jump_s = float(step_s[i]) - usual_s if fault in (Fault.BACKWARDS, Fault.STEPPED) else 0.0
            out.append(Break(fault, at, at + 1, float(track.time_s[at]), float(track.time_s[at + 1]), samples, jump_s))
    return out


def _odd(step_s: Floats, usual_s: float, counted: Ints | None) -> Bools:
    if counted is not None:
        return (counted != 1) | (step_s < 0.0) | (step_s > limits.CLOCK_STEP_PERIODS * usual_s)
    return (step_s <= 0.0) | (step_s > 1.5 * usual_s)


def _frozen(track: Track, moving: Track | None) -> list[Break]:
    other = None if moving is None else moving.curve.at(track.time_s)
    found: dict[tuple[int, int], list[int]] = {}
    for c in range(track.channels):
        values = track.values[:, c]
        equal = values[1:] == values[:-1]
        long = [(first, last) for first, last in _runs(equal) if last - first + 1 >= limits.FEWEST_EQUAL]
        seen = None if other is None else other[:, c]
        least = 0.0 if seen is None or not long else _least(values, seen)
        for first, last in long:
            # Its neighbours in time may belong to the motion before and after: clocks are known to a part of a sample.
            moved = _moved(seen[first + 1 : last], least) if seen is not None else _too_long(equal, first, last)
            if moved and not (seen is not None and _goes_on(values, first, last)):
                found.setdefault((first, last), []).append(c)
    return [
        Break(
            Fault.FROZEN,
            first,
            last,
            float(track.time_s[first]),
            float(track.time_s[last]),
            last - first + 1,
            channels=() if len(channels) == track.channels else tuple(channels),
        )
        for (first, last), channels in found.items()
    ]


def _runs(equal: Bools) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _least(values: Floats, other: Floats) -> float:
    """What must be seen of a motion: the finest step of the one reading, or the noise of the other."""
    steps = np.abs(np.diff(values))
    finest = float(np.min(steps[steps > 0.0], initial=np.inf))
    return max(finest, float(np.nan_to_num(white_noise(other[np.isfinite(other), None])[0])))


def _moved(meanwhile: Floats, least: float) -> bool:
    """Whether another device saw this channel move."""
    seen = meanwhile[np.isfinite(meanwhile)]
    return len(seen) > 0 and bool(np.isfinite(least)) and float(np.ptp(seen)) > limits.MOVED_MEANWHILE * least


def _goes_on(values: Floats, first: int, last: int) -> bool:
    """Whether a reading leaves its run by a step like those before and after: a joint that stuck while its set-point
    crept on. One that was frozen jumps to where the motion has come meanwhile.
    """
    steps = np.abs(np.diff(values))
    after = float(steps[last]) if last < len(steps) else 0.0
    near = np.concatenate(
        [steps[max(0, first - limits.FEWEST_EQUAL) : first], steps[last + 1 : last + 1 + limits.FEWEST_EQUAL]]
    )
    return after <= limits.GOES_ON_STEPS * float(np.max(near, initial=0.0))


def _too_long(equal: Bools, first: int, last: int) -> bool:
    """Whether its own noise would never let it stand so long."""
    run = last - first
    outside = len(equal) - run
    repeats = (int(equal.sum()) - run + 1) / max(outside + 1, 1)
    return bool(len(equal) * repeats**run < limits.FROZEN_CHANCE)
