"""What the devices of a session stream: own clocks, own rates, noise, and stamps of a host that come late."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RATE_HZ = {"robot": 125.0, "encoders": 100.0, "psd": 250.0}
EPOCH_S = 40.0  # nobody sets these clocks: up to so far apart
QUARTZ = 2e-5  # one sigma of their rates
HOST_S = 1000.0
LINE_S = 2e-4  # that a line delays, at least and usually
JOINT_NOISE_RAD, ENCODER_NOISE_RAD = 2e-6, 6e-6
ZERO_RAD, DISC_RAD = 1e-2, 1e-4  # of the second encoders: how they were mounted
LIGHT_A = 1e-4  # of both electrodes of an axis
DARK_A = 1e-9


@dataclass(frozen=True, eq=False)
class Clock:
    """A device's: own = true (1 + rate) + epoch_s."""

    epoch_s: float
    rate: float

    def own(self, true_s: Floats) -> Floats:
        return true_s * (1.0 + self.rate) + self.epoch_s


@dataclass(frozen=True, eq=False)
class Stream:
    """What a recorder gets of one device; `clock` is what is true of its stamps."""

    host_s: Floats
    device_s: Floats
    sequence: NDArray[np.int64]
    values: Mapping[str, Floats]
    clock: Clock


def sample_times(device: str, last_s: float, rng: np.random.Generator) -> Floats:
    """True times (row,) at which a device samples until `last_s`."""
    period_s = 1.0 / RATE_HZ[device]
    return np.arange(rng.uniform(0.0, period_s), last_s, period_s)


def delivered(time_s: Floats, values: Mapping[str, Floats], late_s: float, rng: np.random.Generator) -> Stream:
    """Values that were true at `time_s`, stamped `late_s` afterwards."""
    clock = Clock(float(rng.uniform(0.0, EPOCH_S)), float(QUARTZ * rng.standard_normal()))
    stamped_s = time_s + late_s
    host_s = np.maximum.accumulate(HOST_S + stamped_s + LINE_S + rng.exponential(LINE_S, len(time_s)))
    return Stream(host_s, clock.own(stamped_s), np.arange(len(time_s), dtype=np.int64), values, clock)


def second_encoders(q_rad: Floats, rng: np.random.Generator) -> Floats:
    """(row, n) of encoders at the links: mounted anyhow, discs a little off centre."""
    n = q_rad.shape[1]
    disc = DISC_RAD * np.cos(q_rad + rng.uniform(0.0, 2.0 * np.pi, n))
    return q_rad + disc + ZERO_RAD * rng.standard_normal(n) + ENCODER_NOISE_RAD * rng.standard_normal(q_rad.shape)


def photocurrents_a(spot_m: Floats, half_size_m: float) -> Floats:
    """(row, 8) of both faces: x1, x2, y1, y2 each; dark where a spot is off its face."""
    share = spot_m.reshape(-1, 2, 2) / half_size_m
    lit = np.all(np.abs(share) <= 1.0, axis=2) & np.isfinite(share).all(axis=2)
    pair = 0.5 * LIGHT_A * np.stack((1.0 - share, 1.0 + share), axis=3)
    return np.where(lit[:, :, np.newaxis, np.newaxis], pair, DARK_A).reshape(-1, 8)
