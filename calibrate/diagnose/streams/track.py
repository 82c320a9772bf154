"""One quantity of one device over that device's own clock: what the finders of streams examine."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from calibrate.diagnose.streams import limits
from calibrate.errors import DataError

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.intp]

FEWEST = 4  # points of a cubic
SIGMA_OF_MEDIAN = 1.4826  # 1 / 0.67449: sigma of normal noise over the median of its absolute values


class Outcome(Enum):
    """Of one finder at one stream."""

    FOUND = "beyond the stream's own noise"
    ABSENT = "not beyond the stream's own noise"
    NOT_DETERMINABLE = "this motion does not show it"


@dataclass(frozen=True, eq=False)
class Track:
    """`time_s` (sample,), `values` (sample, channel), NaN where nothing was read. DataError where they disagree."""

    name: str
    unit: str
    time_s: Floats
    values: Floats
    joints: tuple[int, ...] = ()  # of the channels, from 1, where there is not one of every joint in order

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or self.time_s.shape != self.values.shape[:1]:
            raise DataError(
                f"stream {self.name}: {self.time_s.shape} times and values {self.values.shape}; give one row a time"
            )

    @property
    def period_s(self) -> float:
        """Usual time between two samples; NaN for fewer than two."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else float("nan")

    @property
    def channels(self) -> int:
        return self.values.shape[1]

    def joint(self, channel: int) -> int:
        """Number, from 1, of the joint of a channel, from 0."""
        return self.joints[channel] if self.joints else channel + 1

    def of(self, channels: Sequence[int]) -> "Track":
        """These channels alone."""
        some = [*channels]
        return replace(self, values=self.values[:, some], joints=tuple(map(self.joint, some)))

    def read(self) -> "Track":
        """Without samples in which a channel was not read, in rising time; later stamps of one time are left out."""
        good = np.all(np.isfinite(self.values), axis=1) & np.isfinite(self.time_s)
        _, first = np.unique(self.time_s[good], return_index=True)
        return self.take(np.flatnonzero(good)[first])

    @cached_property
    def curve(self) -> "TrackCurve":
        """Between its samples; made once."""
        return TrackCurve(self)

    def take(self, rows: Bools | Ints | slice) -> "Track":
        return replace(self, time_s=self.time_s[rows], values=self.values[rows])

    def between(self, from_s: float, to_s: float) -> "Track":
        """Ends included."""
        return self.take((self.time_s >= from_s) & (self.time_s <= to_s))


class TrackCurve:
    """A track between its samples: cubic splines, NaN in gaps and outside. `rate`: its slope, (time, channel)."""

    def __init__(self, track: Track) -> None:
        track = track.read()
        self.channels = track.channels
        self._pieces = [
            CubicSpline(track.time_s[rows], track.values[rows])
            for rows in stretches(track.time_s)
            if rows.stop - rows.start >= FEWEST
        ]

    def at(self, time_s: Floats) -> Floats:
        return self._each(time_s, 0)

    def rate(self, time_s: Floats) -> Floats:
        return self._each(time_s, 1)

    def _each(self, time_s: Floats, derivative: int) -> Floats:
        out = np.full((len(time_s), self.channels), np.nan)
        for piece in self._pieces:
            inside = (time_s >= piece.x[0]) & (time_s <= piece.x[-1])
            out[inside] = piece(time_s[inside], derivative)
        return out


def stretches(time_s: Floats) -> Iterator[slice]:
    """Runs of samples without a gap."""
    if not len(time_s):
        return
    steps = np.diff(time_s)
    usual = float(np.median(steps)) if len(steps) else 0.0
    breaks = np.flatnonzero((steps > limits.GAP_PERIODS * usual) | (steps <= 0.0)) + 1
    yield from (slice(int(a), int(b)) for a, b in zip([0, *breaks], [*breaks, len(time_s)], strict=True))


def white_noise(values: Floats) -> Floats:
    """(channel,) sigma of one sample from second differences: what moves slowly does not count.

    Variance of x[i-1] - 2 x[i] + x[i+1] of white noise is 6 sigma^2 (Gasser, Sroka, Jennen-Steinmetz, Biometrika 1986);
    from the median, so that single steps do not count either.
    """
    if len(values) < FEWEST:
        return np.full(values.shape[1], np.nan)
    second = values[:-2] - 2.0 * values[1:-1] + values[2:]
    return SIGMA_OF_MEDIAN * np.median(np.abs(second), axis=0) / np.sqrt(6.0)
