"""The streams of two recordings: of one motion each device's clock against its twin, and what is left then.

Two sessions whose servos corrected otherwise did not move alike, so their streams are no twins; but a lag, a following
error or a ringing is a property of the machine, and each recording shows its own: these are put side by side.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess import Named
from calibrate.diagnose.streams import (
    ClockFit,
    ClockStatus,
    Outcome,
    StreamDevice,
    StreamFinding,
    StreamReport,
    Track,
    clock_between,
    white_noise,
)
from calibrate.model.effects.term import Size

Floats = NDArray[np.float64]

SENT = "command"
ZEROLESS = "encoders"  # their zeros are arbitrary
ORDER = (SENT, "joints", "encoders", "spots")
BEYOND = 5.0  # sigmas of a sample's noise, of the median of what differs: more than noise can do
CLEAR = 5.0  # sigmas of a difference of two sizes
ALIKE = 0.05  # of the larger size: two estimates of one law differ by their models, too
LOST = ("missing-samples", "duplicated-samples")  # of a line, not of a machine
NOISIER = 1.5  # times, of a stream's noise
FINEST = 1e-12  # of its unit: below, a stream is without noise


@dataclass(frozen=True)
class StreamPair:
    """One device in both; numbers None where the clocks could not be brought together."""

    stream: str
    unit: str
    clock: ClockFit
    samples: int
    level: tuple[float, ...] | None  # (channel,) median of measured less simulated
    rms: float | None  # about the level
    noise: float | None  # of one difference, by both streams' own
    largest: float | None
    largest_s: float | None  # on the measured clock
    parts: bool | None  # None: not the same motion, or not known to be


def stream_pairs(measured: Mapping[str, StreamDevice], simulated: Mapping[str, StreamDevice]) -> tuple[StreamPair, ...]:
    """Of every device that both recordings have, in the order of the chain.

    Where the arms were sent otherwise (a servo corrects what it sees), the others do not part: nothing is expected.
    """
    pairs = [
        stream_pair(name, measured[name], simulated[name]) for name in ORDER if name in measured and name in simulated
    ]
    sent = next((pair for pair in pairs if pair.stream == SENT), None)
    if sent is not None and sent.parts is False:
        return tuple(pairs)
    return tuple(replace(pair, parts=None) for pair in pairs)


def stream_pair(name: str, measured: StreamDevice, simulated: StreamDevice) -> StreamPair:
    """Two sessions were not recorded by one host at one time, so its stamps show nothing: the motion itself does."""
    one, two = measured.track.read(), simulated.track.read()
    clock = clock_between(two, one) if one.channels == two.channels else ClockFit(ClockStatus.UNRELATED)
    if clock.offset_s is None:
        return StreamPair(name, one.unit, clock, 0, None, None, None, None, None, None)
    left = one.values - two.curve.at(clock.to_reference(one.time_s))
    good = np.all(np.isfinite(left), axis=1)
    left, time_s = left[good], one.time_s[good]
    noise = np.hypot(white_noise(one.values), white_noise(two.values))
    level = np.median(left, axis=0)
    about = left - level
    row, channel = np.unravel_index(int(np.argmax(np.abs(about))), about.shape)
    usual = np.median(np.abs(about), axis=0)
    floor = np.maximum(noise, _resolution(one))
    return StreamPair(
        name,
        one.unit,
        clock,
        len(left),
        tuple(float(v) for v in level),
        float(np.sqrt(np.mean(about**2))),
        float(np.median(floor)),
        float(np.abs(about[row, channel])),
        float(time_s[row]),
        bool(np.any(usual > BEYOND * floor) or (name != ZEROLESS and np.any(np.abs(level) > BEYOND * floor))),
    )


def _resolution(track: Track) -> Floats:
    """(channel,) one count of what is quantised; 1e-9 of the unit for exact numbers."""
    steps = np.abs(np.diff(track.values, axis=0))
    finest = np.array([np.min(c[c > 0.0], initial=np.inf) for c in steps.T])
    return np.maximum(np.where(np.isfinite(finest), np.minimum(finest, 1e-4), 0.0), 1e-9)


def late_against_joints(pairs: tuple[StreamPair, ...]) -> Mapping[str, tuple[float, float]]:
    """Device -> (s, sigma) by which its readings come later after the motion of the joints than in the simulation.

    Only where devices of one recording share a clock, or keep theirs apart alike, is that a cause of its own.
    """
    at = {pair.stream: pair.clock for pair in pairs if pair.clock.offset_s is not None}
    joints = at.get("joints")
    if joints is None or joints.offset_s is None:
        return {}
    out: dict[str, tuple[float, float]] = {}
    for name, clock in at.items():
        if name == "joints" or clock.offset_s is None:
            continue
        here = float(joints.to_reference(np.array([clock.middle_s]))[0]) - clock.middle_s
        sigma = float(np.hypot(clock.offset_sigma_s or 0.0, joints.offset_sigma_s or 0.0))
        out[name] = (here - clock.offset_s, sigma)
    return out


@dataclass(frozen=True)
class StreamDifference:
    """One property of a stream; None: that recording does not show it."""

    name: Named
    stream: str
    parameter: str
    measured: Size | None
    simulated: Size | None


@dataclass(frozen=True)
class NoiseDifference:
    """White noise of one device's stream, one sigma, median of its channels."""

    stream: str
    unit: str
    measured: float
    simulated: float


def stream_differences(measured: StreamReport | None, simulated: StreamReport | None) -> tuple[StreamDifference, ...]:
    """Of streams that both recordings have; nothing where one has none."""
    if measured is None or simulated is None:
        return ()
    one, two = _by_name(measured), _by_name(simulated)
    names = list(dict.fromkeys((*one, *two)))
    return tuple(d for name in names for d in _between(one.get(name), two.get(name)))


def noise_differences(
    measured: Mapping[str, StreamDevice], simulated: Mapping[str, StreamDevice]
) -> tuple[NoiseDifference, ...]:
    """Of devices that both have, where one is clearly noisier."""
    out: list[NoiseDifference] = []
    for name in (name for name in ORDER if name in measured and name in simulated):
        one, two = (float(np.median(white_noise(side[name].track.read().values))) for side in (measured, simulated))
        if max(one, two) > FINEST and max(one, two) > NOISIER * min(one, two):
            out.append(NoiseDifference(name, measured[name].track.unit, one, two))
    return tuple(sorted(out, key=lambda d: d.stream))


def _by_name(report: StreamReport) -> dict[tuple[Named, str], StreamFinding]:
    found = (f for f in report.findings if f.outcome is Outcome.FOUND and f.name.physics not in LOST)
    return {(f.name, f.stream): f for f in found}


def _between(one: StreamFinding | None, two: StreamFinding | None) -> Iterator[StreamDifference]:
    shown = one if one is not None else two
    if shown is None or not shown.parameters:
        return
    parameter = next(iter(shown.parameters))
    sizes = [None if f is None else f.parameters.get(parameter) for f in (one, two)]
    if not _same(sizes[0], sizes[1]):
        yield StreamDifference(shown.name, shown.stream, parameter, sizes[0], sizes[1])


def _same(one: Size | None, two: Size | None) -> bool:
    if one is None or two is None:
        return False
    apart, sigma = abs(one.value - two.value), float(np.hypot(one.sigma, two.sigma))
    return apart <= max(CLEAR * np.nan_to_num(sigma), ALIKE * max(abs(one.value), abs(two.value)))
