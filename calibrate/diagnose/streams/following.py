"""Following error of each joint: how far the reading is behind the set-point, by speed and by acceleration.

    command - reading = level + v / K_v + a / K_a

K_v is the velocity gain of a position loop (Altintas, Manufacturing Automation, 2nd ed., section 5.4: steady following
error of a ramp). A pure delay T and a first-order lag tau give the same 1 / K_v = T + tau; by acceleration they differ:
- T^2 / 2 against - tau^2 (series of exp(-sT) and 1 / (1 + s tau)).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.clock import RobustLine, fit
from calibrate.diagnose.streams.track import Outcome, Track

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Following:
    """One joint (from 1). Behind by `behind_s` of speed and `by_acceleration_s2`; `kind` where they show it."""

    joint: int
    outcome: Outcome
    behind_s: float | None = None
    behind_sigma_s: float | None = None
    by_acceleration_s2: float | None = None
    by_acceleration_sigma_s2: float | None = None
    kind: str = "undetermined"  # "delay", "first-order lag", "undetermined"
    p: float = 1.0
    why: str = ""  # nothing is determined

    @property
    def velocity_gain_per_s(self) -> float | None:
        """None where the reading is not behind."""
        return 1.0 / self.behind_s if self.behind_s is not None and self.behind_s > 0.0 else None


def following(command: Track, reading: Track) -> tuple[Following, ...]:
    """Both on one clock, one channel a joint."""
    reading = reading.read()
    at, v, a = course_of(command, reading.time_s)
    good = np.all(np.isfinite(at) & np.isfinite(v) & np.isfinite(a), axis=1)
    block = np.floor((reading.time_s - reading.time_s[:1].sum()) / limits.BLOCK_S).astype(np.intp)
    still = np.ptp(reading.values[good], axis=0) == 0.0 if np.any(good) else np.zeros(reading.channels, dtype=bool)
    return tuple(
        Following(reading.joint(j), Outcome.NOT_DETERMINABLE, why="the reading never changes")
        if still[j]
        else _joint(reading.joint(j), (at - reading.values)[good, j], v[good, j], a[good, j], block[good])
        for j in range(reading.channels)
    )


def course_of(track: Track, time_s: Floats) -> tuple[Floats, Floats, Floats]:
    """(time, channel) value, speed and acceleration of a track, by differences over SPEED_OVER_S; NaN in gaps."""
    curve, step_s = track.curve, limits.SPEED_OVER_S
    at, ahead, back = curve.at(time_s), curve.at(time_s + step_s), curve.at(time_s - step_s)
    return at, (ahead - back) / (2.0 * step_s), (ahead - 2.0 * at + back) / step_s**2


def _joint(joint: int, error: Floats, v: Floats, a: Floats, block: NDArray[np.intp]) -> Following:
    if not len(error):
        return Following(joint, Outcome.NOT_DETERMINABLE, why="no rows in which set-point and reading were both read")
    if float(np.sqrt(np.mean(v**2))) < limits.SLOWEST_RAD_S:
        return Following(joint, Outcome.NOT_DETERMINABLE, why="it hardly moves")
    line = fit(np.stack([v, a, np.ones_like(v)], axis=1), error, block, rounds=1)
    if line is None:
        return Following(joint, Outcome.NOT_DETERMINABLE, why="the motion is too short, or too even")
    behind_s, sigma_s = float(line.values[0]), float(line.sigma[0])
    p = float(2.0 * ndtr(-abs(behind_s) / max(sigma_s, 1e-300)))
    found = p < limits.FOLLOWING_ALPHA and abs(behind_s) > limits.BEHIND_S
    return Following(
        joint,
        Outcome.FOUND if found else Outcome.ABSENT,
        behind_s,
        sigma_s,
        float(line.values[1]),
        float(line.sigma[1]),
        _kind(line) if found else "undetermined",
        p,
    )


def _kind(line: RobustLine) -> str:
    """By what acceleration adds, where its sigma separates the two."""
    behind_s, by_a = float(line.values[0]), float(line.values[1])
    sigma = float(line.sigma[1])
    delay, lag = -(behind_s**2) / 2.0, -(behind_s**2)
    if abs(delay - lag) < 6.0 * sigma:
        return "undetermined"
    if abs(by_a - delay) < max(3.0 * sigma, 0.15 * behind_s**2):
        return "delay"
    return "first-order lag" if abs(by_a - lag) < max(3.0 * sigma, 0.15 * behind_s**2) else "undetermined"
