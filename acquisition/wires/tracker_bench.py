"""The bench of a session with a tracker: the arm moved, its target read once it has settled, averaged over a dwell.

Settling is judged as before two detectors (`bench`): neighbouring short windows agree within their noise. An
instrument without a clock of its own is taken to keep the rate that its rig file states.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import ArmReading
from acquisition.wires.bench import (
    SILENCE_S,
    ArmOnWires,
    SettleRule,
    device_time,
    stretch_to_average,
)
from drivers.device import Block
from drivers.errors import DeviceStale

Floats = NDArray[np.float64]
CLOCK_S = 5.0  # host time within which a reading of after the motion comes; emulators fall behind by less
LEAST_HALF = 5  # samples of half a dwell: with fewer their scatter means nothing
CALMER = 2.5  # of 20 samples of noise one half scatters so much more in 2 of 100 dwells: these begin a little later
GOOD_SHARE = 0.5  # of the samples of a dwell that have to be good


@dataclass(frozen=True)
class TargetLook(ArmReading):
    """A reading of the target. A position that was not seen in half of the samples, or more, is NaN."""

    position_m: Floats  # (3,) in the instrument's frame
    sigma_m: Floats  # (3,) of the mean, from the scatter of the samples
    samples: int  # good ones


@dataclass(kw_only=True)
class TrackerBench(ArmOnWires):
    """`rate_hz`: of the instrument, as stated."""

    rate_hz: float
    rule: SettleRule = field(default_factory=lambda: SettleRule(limit_s=3.0))

    def look(self, dwell_s: float) -> TargetLook:
        """Wait until the position has settled, then average `dwell_s` of the instrument's time. DeviceError."""
        self.supervisor.check()
        seen_s = self.clock.now_s()
        begin_s = self._begin_s(seen_s)
        blocks: list[Block] = []
        from_s = -np.inf
        while True:
            arrived = self.pumps.instrument.wait(seen_s, SILENCE_S)
            self.supervisor.check()
            seen_s = float(arrived[-1].host_s[-1])
            blocks += arrived
            window = _window(blocks, begin_s, self.rate_hz)
            if len(window.time_s) == 0:
                if seen_s - float(blocks[0].host_s[0]) > CLOCK_S:
                    raise DeviceStale(
                        "tracker: its time does not go on, or went back, since the last motion; check its clock (some "
                        "restart at midnight), or leave out the time column"
                    )
                continue
            first_s = float(window.time_s[0])
            window = window.only(window.time_s >= from_s)
            stretch = stretch_to_average(window.time_s, window.position_m, dwell_s, self.rule)
            if stretch is None:
                continue
            held = window.only((window.time_s >= stretch.from_s) & (window.time_s <= stretch.to_s))
            late = stretch.to_s - first_s > self.rule.limit_s + dwell_s
            steady = stretch.settled and not calms_down(held.position_m, self.rule)
            if steady or late or not stretch.settled:
                return self._averaged(held, settled=steady)
            from_s = float(held.time_s[len(held.time_s) // 4])  # begin later

    def _begin_s(self, host_s: float) -> float | None:
        """By the instrument's clock; None: it has none."""
        newest = self.pumps.instrument.latest() or self.pumps.instrument.wait(-np.inf, SILENCE_S)[-1]
        return device_time(self.pumps.instrument, host_s, self.hurry) if np.isfinite(newest.device_s[-1]) else None

    def _averaged(self, window: "TargetWindow", *, settled: bool) -> TargetLook:
        clocked = bool(np.isfinite(window.device_s).all())
        now_s = float(window.device_s.mean() if clocked else self.hurry * window.host_s.mean())
        good_m = window.position_m[np.isfinite(window.position_m).all(axis=1)]
        enough = len(good_m) > max(1.0, GOOD_SHARE * len(window.position_m))
        nowhere = np.full(3, np.nan)
        air = {"air": float(np.mean(window.temperature_degC))} if len(window.temperature_degC) else {}
        reading = self._reading(window.host_s, now_s, air, now_s, settled=settled)
        return TargetLook(
            **vars(reading),
            position_m=good_m.mean(axis=0) if enough else nowhere,
            sigma_m=good_m.std(axis=0, ddof=1) / np.sqrt(len(good_m)) if enough else nowhere,
            samples=len(good_m),
        )


def calms_down(position_m: Floats, rule: SettleRule) -> bool:
    """Whether positions (sample, 3) of a dwell scatter more at its beginning than at its end: the arm still swings.

    The windows of a slow instrument are of few samples, between which a swing of the arm resembles noise.
    """
    half = len(position_m) // 2
    early_m, later_m = (part[np.isfinite(part).all(axis=1)] for part in (position_m[:half], position_m[half:]))
    if min(len(early_m), len(later_m)) < LEAST_HALF:
        return False
    early, later = early_m.std(axis=0), later_m.std(axis=0)
    return bool(np.any(early > np.maximum(CALMER * later, rule.floor_m)))


@dataclass(frozen=True)
class TargetWindow:
    """Consecutive samples of a tracker; `time_s`: by which settling and dwells are judged."""

    host_s: Floats  # (sample,)
    device_s: Floats  # (sample,), NaN: it has no clock
    time_s: Floats  # (sample,)
    position_m: Floats  # (sample, 3)
    temperature_degC: Floats  # (sample,), or empty: it reports none

    def only(self, keep: NDArray[np.bool_]) -> "TargetWindow":
        degC = self.temperature_degC[keep] if len(self.temperature_degC) else self.temperature_degC
        return TargetWindow(self.host_s[keep], self.device_s[keep], self.time_s[keep], self.position_m[keep], degC)


def _window(blocks: Sequence[Block], begin_s: float | None, rate_hz: float) -> TargetWindow:
    def column(name: str) -> Floats:
        return np.concatenate([block.values[name] for block in blocks])

    device_s = np.concatenate([block.device_s for block in blocks])
    number = np.concatenate([block.sequence for block in blocks]).astype(np.float64)
    whole = TargetWindow(
        np.concatenate([block.host_s for block in blocks]),
        device_s,
        (number - number[0]) / rate_hz if begin_s is None else device_s,
        column("position_m"),
        column("temperature_degC") if "temperature_degC" in blocks[0].values else np.empty(0),
    )
    return whole if begin_s is None else whole.only(device_s >= begin_s)
