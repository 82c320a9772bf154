"""Streams with emulated stamps, and the true times behind them, which only the tests know."""

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.recording import Channel, Recording, Stamps, Stream
from acquisition.recording.rig import parse_rig
from acquisition.recording.rig.devices import Devices, TrackerDevice, TrackerDriver
from acquisition.recording.sample_rules import no_samples

Floats = NDArray[np.float64]
NOMINAL_HZ = 100.0
ROWS = 6000


@dataclass(frozen=True)
class World:
    """A device that measures at its own pace, off the nominal one by a quartz unless `off` states more."""

    rng: np.random.Generator
    true_s: Floats

    def prompt(self) -> Floats:
        """Arrivals with normal jitter, and a host that is busy for some milliseconds now and then."""
        late_s = self.true_s + np.abs(self.rng.normal(0.0, 2e-4, self.true_s.size))
        for begin_s in late_s[self.rng.integers(0, late_s.size, 6)]:
            end_s = begin_s + self.rng.uniform(2e-3, 15e-3)
            late_s[(late_s >= begin_s) & (late_s < end_s)] = end_s
        return np.maximum.accumulate(late_s)

    def in_bursts(self, pause_s: float = 0.3) -> Floats:
        """Sent on every 0.3 s or so, row after row."""
        count = int(2.0 * np.ptp(self.true_s) / pause_s) + 2
        ends_s = self.true_s[0] + np.cumsum(pause_s * (1.0 + 0.1 * self.rng.standard_normal(count)))
        burst = np.searchsorted(ends_s, self.true_s)
        rows = np.concatenate([np.arange(n) for n in np.unique(burst, return_counts=True)[1]])
        return np.maximum.accumulate(ends_s[burst] + 3e-4 * rows * self.rng.uniform(0.5, 1.5))

    def in_batches(self, size: int = 16) -> Floats:
        """Handed over when `size` are together, some microseconds apart."""
        batch, place = np.divmod(np.arange(self.true_s.size), size)
        last_s = self.true_s[np.minimum(size * batch + size - 1, self.true_s.size - 1)]
        return last_s + np.abs(self.rng.normal(0.0, 3e-4, int(batch[-1]) + 1))[batch] + 1e-5 * place


def world(seed: int, off: float = 0.0, rows: int = ROWS) -> World:
    rng = np.random.default_rng(seed)
    period_s = float(1.0 + rng.normal(0.0, 5e-5)) / (NOMINAL_HZ * (1.0 + off))
    return World(rng, 1000.0 + period_s * np.arange(rows, dtype=np.float64))


def stream(
    host_s: Floats, sequence: NDArray[np.int64] | None = None, device_s: Floats | None = None,
    stamps: Stamps = "arrived", name: str = "tracker",
) -> Stream:  # fmt: skip
    rows = host_s.size
    return Stream(
        name,
        (Channel("x_m", "m"),),
        host_s,
        np.full(rows, np.nan) if device_s is None else device_s,
        np.arange(rows) if sequence is None else sequence,
        {"x_m": np.arange(rows, dtype=float)},
        stamps=stamps,
    )


def recording(rig_text: str, *streams: Stream) -> Recording:
    """With a tracker of 100 readings a second in its rig."""
    rig = parse_rig(rig_text, "rig.toml")
    tracker = TrackerDevice(TrackerDriver.ASCII_LINES, "m", columns=("x", "y", "z"), rate_hz=NOMINAL_HZ)
    rig = msgspec.structs.replace(rig, devices=Devices(tracker=tracker))
    whole = Recording(Path("log.mcap"), rig_text, rig, no_samples(rig), complete=True, notes={"segment": "1"})
    return replace(whole, streams={one.name: one for one in streams})
