"""When a reading may be taken: the probe stays where it is, though the hand trembles. Across a slip it does not.

A ball in a seat stays while the joints go round it, so it is the probe's place that is judged, from windows of whole
rows of the newest time, as the reader thread brings them. The assumed arm, passed in, serves well enough: geometry
that is off by 1e-3 shows a tremble of a milliradian as a micrometre.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.wires.streams import Pump, Supervisor
from drivers.device import Block

Floats = NDArray[np.float64]


class GuidedArm(Protocol):
    """A measuring arm as assumed."""

    @property
    def lower_rad(self) -> Floats:
        """(n,) smallest readings."""
        ...

    @property
    def upper_rad(self) -> Floats: ...

    def tip_m(self, q_rad: Floats) -> Floats:
        """(row, 3) middle of the probe's ball in the base, for readings (row, n)."""
        ...

    def postures(self, start_rad: Floats, point_m: Floats) -> Floats:
        """Of starts (row, n) those brought to the point (3,) within the joints' ranges, (some, n)."""
        ...


@dataclass(frozen=True, eq=False)
class Window:
    """In the order of time."""

    t_s: Floats  # (sample,) of the encoders' own time
    host_s: Floats  # (sample,)
    q_rad: Floats  # (sample, n)

    def __len__(self) -> int:
        return len(self.t_s)

    def last(self, seconds: float) -> "Window":
        """The end of it."""
        keep = self.t_s >= self.t_s[-1] - seconds
        return Window(self.t_s[keep], self.host_s[keep], self.q_rad[keep])


class EncoderWatch(Protocol):
    """The encoders as they come in, wired or not."""

    def next(self, seconds: float) -> Window:
        """Waits for a new sample; then the newest `seconds` of rows with all encoders. DeviceError, RecordingError."""
        ...


PARTS = 4  # that a dwell is cut into; a slip shows between their means


class ArmMotion(Enum):
    """What a window shows."""

    SHORT = "too few samples yet"
    MOVING = "moving"
    STILL = "still"


@dataclass(frozen=True)
class StillRule:
    """Over `dwell_s` the probe stays within `place_m`, or within `sigmas` of what its samples scatter."""

    dwell_s: float = 0.5
    least: int = 8  # samples
    place_m: float = 15e-6  # beyond what a reading's noise gives at 1 m; a ball on the rim is off by ten times that
    sigmas: float = 6.0
    joint_rad: float = (
        0.01  # swing of a joint: beyond, the probe's place at the mean angle is not its mean place: 10 µm
    )

    def judge(self, arm: GuidedArm, window: Window) -> ArmMotion:
        """Of the last `dwell_s` of a window."""
        held = window.last(self.dwell_s)
        if len(held) < self.least or held.t_s[-1] - held.t_s[0] < 0.8 * self.dwell_s:
            return ArmMotion.SHORT
        tips_m = arm.tip_m(held.q_rad)
        swing_rad = float(np.ptp(held.q_rad, axis=0).max())
        places_m, noise_m = self._places(tips_m)
        way_m = float(np.ptp(places_m, axis=0).max())
        stays = way_m <= max(self.place_m, self.sigmas * noise_m)
        return ArmMotion.STILL if stays and swing_rad <= self.joint_rad else ArmMotion.MOVING

    @staticmethod
    def _places(tips_m: Floats) -> tuple[Floats, float]:
        """Mean places (part, 3) and one sigma of each, from neighbouring samples so that drift does not count."""
        parts = np.array_split(tips_m, PARTS)
        noise_m = float(np.median(np.abs(np.diff(tips_m, axis=0)))) * 1.4826 / np.sqrt(2.0)
        return np.array([part.mean(axis=0) for part in parts]), noise_m / np.sqrt(len(parts[0]))


SILENCE_S = 1.0  # host time without a sample after which a wait gives up: longer than the reader's own


class WiredEncoderWatch:
    """Implements acquisition.guided.stillness.EncoderWatch. `hurry`: device seconds in one second of the stamps."""

    def __init__(self, pump: Pump, supervisor: Supervisor, hurry: float = 1.0, channel: str = "position_rad") -> None:
        self._pump, self._supervisor, self._hurry, self._channel = pump, supervisor, hurry, channel
        self._blocks: deque[Block] = deque()
        self._seen_s = -np.inf

    def next(self, seconds: float) -> Window:
        while True:
            self._supervisor.check()
            arrived = self._pump.wait(self._seen_s, SILENCE_S)
            self._seen_s = float(arrived[-1].host_s[-1])
            self._blocks += arrived
            while self._blocks[0].device_s[-1] < self._blocks[-1].device_s[-1] - 1.5 * seconds / self._hurry:
                self._blocks.popleft()
            window = self._whole()
            if len(window):
                return window

    def _whole(self) -> Window:
        """Rows in which every encoder answered."""
        t_s = np.concatenate([block.device_s for block in self._blocks]) * self._hurry
        host_s = np.concatenate([block.host_s for block in self._blocks])
        q_rad = np.concatenate([block.values[self._channel] for block in self._blocks])
        whole = np.all(np.isfinite(q_rad), axis=1)
        return Window(t_s[whole], host_s[whole], q_rad[whole])
