"""How the host's clock and a device's own belong together, from the times at which its samples arrived.

    host_s = offset_s + rate * device_s + delay,   delay >= 0

A sample cannot arrive before it was measured, so the line lies under every point, as close as it can: the smallest sum
of delays (Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements", IEEE
INFOCOM 1999, section IV). Its answer is an edge of the lower convex hull: the one over the mean of the device's times.
What a busy host, a USB frame or a batch adds is delay, not clock; a constant delay cannot be separated from the offset.
"""

import enum
from dataclasses import dataclass

import numpy as np

from acquisition.recording.recording import Stream
from acquisition.recording.samples import Floats

FEWEST = 10  # samples
SHORTEST_S = 1.0  # of device time: below it a delay of a millisecond resembles a rate of 0.1 %
WINDOW_S = 60.0  # a crystal's rate changes with the room's temperature, over minutes
THINNINGS = 8  # each leaves half of the points or fewer for the slow loop
WINDOWS_LEAST = 3  # for a statement about how the rate changes


class ClockStatus(enum.Enum):
    """How the comparison ended."""

    FOUND = "found"
    TOO_SHORT = "too few samples, or too short a time, to separate a rate from delays"
    GOES_BACK = "the device's clock goes back: it was restarted or set"
    UNSTAMPED = "the device does not stamp its samples"


@dataclass(frozen=True)
class ClockModel:
    """Numbers are None unless FOUND. Delays are what the line leaves: how late samples came, beyond the promptest."""

    status: ClockStatus
    offset_s: float | None = None  # host time when the device's clock shows 0, plus the least delay
    rate: float | None = None  # host seconds in one second of the device
    delay_median_s: float | None = None
    delay_p99_s: float | None = None
    wander_s: float | None = None  # farthest that the line of a minute is from that of the whole, at its middle


def clock_model(stream: Stream) -> ClockModel:
    """Of the stamps of one stream; samples without a stamp are left out."""
    stamped = np.isfinite(stream.device_s)
    device_s, host_s = stream.device_s[stamped], stream.host_s[stamped]
    if stream.device_s.size and not device_s.size:
        return ClockModel(ClockStatus.UNSTAMPED)
    if np.any(np.diff(device_s) < 0.0):
        return ClockModel(ClockStatus.GOES_BACK)
    line = _line_under(device_s, host_s)
    if line is None:
        return ClockModel(ClockStatus.TOO_SHORT)
    middle_s, level_s, rate = line
    delay_s = host_s - (level_s + rate * (device_s - middle_s))
    return ClockModel(
        ClockStatus.FOUND,
        level_s - rate * middle_s,
        rate,
        float(np.median(delay_s)),
        float(np.quantile(delay_s, 0.99)),
        _wander(device_s, host_s, line),
    )


def _line_under(device_s: Floats, host_s: Floats) -> tuple[float, float, float] | None:
    """Device time in the middle, host time of the line there, rate. None where there is too little."""
    if device_s.size < FEWEST or device_s[-1] - device_s[0] < SHORTEST_S:
        return None
    middle_s = float(device_s.mean())
    x, y = device_s - middle_s, host_s - host_s[0] - (device_s - device_s[0])  # without what rounds off
    corner_x, corner_y = _lower_hull(x, y)
    right = int(np.searchsorted(corner_x, 0.0, side="right"))
    right = min(max(right, 1), corner_x.size - 1)
    left = right - 1
    slope = float((corner_y[right] - corner_y[left]) / (corner_x[right] - corner_x[left]))
    level = float(corner_y[left] - slope * corner_x[left])
    return middle_s, level + float(host_s[0] - device_s[0]) + middle_s, 1.0 + slope


def _lower_hull(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Corners of the lower convex hull, left to right; x does not fall (Andrew's monotone chain, 1979)."""
    x, y = _without_inner(x, y)
    hull: list[int] = []
    xs, ys = x.tolist(), y.tolist()
    for at in range(len(xs)):
        while len(hull) > 1:
            a, b = hull[-2], hull[-1]
            if (xs[b] - xs[a]) * (ys[at] - ys[a]) > (ys[b] - ys[a]) * (xs[at] - xs[a]):
                break
            hull.pop()
        hull.append(at)
    return x[hull], y[hull]


def _without_inner(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The lowest point of each x, and of them none that lies on or above the chord of its two neighbours."""
    starts = np.flatnonzero(np.diff(x, prepend=-np.inf) != 0.0)
    x, y = x[starts], np.minimum.reduceat(y, starts)
    for _ in range(THINNINGS):
        chord = (y[2:] - y[:-2]) * (x[1:-1] - x[:-2])
        below = np.ones(x.size, dtype=bool)
        below[1:-1] = (y[1:-1] - y[:-2]) * (x[2:] - x[:-2]) < chord
        x, y = x[below], y[below]
    return x, y


def _wander(device_s: Floats, host_s: Floats, line: tuple[float, float, float]) -> float | None:
    middle_s, level_s, rate = line
    edges = np.arange(device_s[0], device_s[-1], WINDOW_S)
    bounds = np.searchsorted(device_s, [*edges, np.inf])
    away: list[float] = []
    for begin, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        part = _line_under(device_s[begin:end], host_s[begin:end])
        if part is not None:
            away.append(abs(part[1] - (level_s + rate * (part[0] - middle_s))))
    return max(away) if len(away) >= WINDOWS_LEAST else None
