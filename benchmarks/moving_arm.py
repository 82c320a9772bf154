"""An arm that moves and stands, by plain mechanics, as its devices' streams would show it.

Joints are second-order servos behind a trapezoid of speed; a soft pedestal rings on after a stop. Nothing here is
shared with what is tested: closed-form motion, integrated by scipy's own linear systems.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import StateSpace, lfilter, ss2tf

Floats = NDArray[np.float64]
STEP_S = 1e-3


@dataclass(frozen=True)
class Motion:
    """Set-points on an even grid of true time, and when the arm was asked to stand."""

    time_s: Floats  # (step,)
    command_rad: Floats  # (step, joint)
    stands: Floats  # (stand, 2) true time from, to


def motion(rng: Generator, moves: int = 20, joints: int = 6, speed: float = 0.6, stand_s: float = 0.6) -> Motion:
    """Random moves with trapezoid speed, each followed by a stand."""
    at, pieces, stands, now_s = np.zeros(joints), [], [], 0.0
    for _ in range(moves):
        pieces.append(np.tile(at, (round(stand_s / STEP_S), 1)))
        stands.append((now_s, now_s + stand_s))
        now_s += stand_s
        goal = at + rng.uniform(-0.3, 0.3, joints)
        lasts_s = float(np.max(np.abs(goal - at))) / speed * 1.25
        t = np.arange(0.0, lasts_s, STEP_S)
        pieces.append(at + trapezoid(t / lasts_s)[:, None] * (goal - at))
        at, now_s = goal, now_s + len(t) * STEP_S
    pieces.append(np.tile(at, (round(stand_s / STEP_S), 1)))
    stands.append((now_s, now_s + stand_s))
    command = np.concatenate(pieces)
    return Motion(STEP_S * np.arange(len(command), dtype=np.float64), command, np.array(stands))


def trapezoid(share: Floats) -> Floats:
    """Way done after a share of the time: a quarter each of speeding up and of braking, at even acceleration."""
    ramp, top = 0.25, 1.0 / 0.75
    up = 0.5 * top / ramp * np.minimum(share, ramp) ** 2
    level = top * np.clip(share - ramp, 0.0, 1.0 - 2.0 * ramp)
    late = np.clip(share - 1.0 + ramp, 0.0, ramp)
    return up + level + top * late - 0.5 * top / ramp * late**2


def followed(command: Floats, frequency_hz: float, damping: float, lag_s: float = 0.0) -> Floats:
    """Each joint as a servo of second order without feed-forward of its speed, behind a first-order filter."""
    w = 2.0 * np.pi * frequency_hz
    servo = StateSpace([[0.0, 1.0], [-(w**2), -2.0 * damping * w]], [[0.0], [w**2]], [[1.0, 0.0]], [[0.0]])
    at = command[0]
    out = np.stack([start + _through(servo, channel - start) for start, channel in zip(at, command.T, strict=True)], 1)
    if lag_s > 0.0:
        slow = StateSpace([[-1.0 / lag_s]], [[1.0 / lag_s]], [[1.0]], [[0.0]])
        out = np.stack(
            [start + _through(slow, channel - start) for start, channel in zip(out[0], out.T, strict=True)], 1
        )
    return out


def swaying(acceleration: Floats, frequency_hz: float, damping: float) -> Floats:
    """What a mass on a spring adds when it is shaken: x'' + 2 z w x' + w^2 x = -a."""
    w = 2.0 * np.pi * frequency_hz
    sprung = StateSpace([[0.0, 1.0], [-(w**2), -2.0 * damping * w]], [[0.0], [-1.0]], [[1.0, 0.0]], [[0.0]])
    return _through(sprung, acceleration)


def sampled(time_s: Floats, values: Floats, at_s: Floats) -> Floats:
    """(sample, channel) of a true motion at true times."""
    return np.stack([np.interp(at_s, time_s, channel) for channel in values.T], axis=1)


def _through(system: StateSpace, u: Floats) -> Floats:
    """From rest; straight lines between the steps, as scipy's lsim takes them, whose loop in Python takes a second."""
    discrete = system.to_discrete(STEP_S, method="foh")
    (numerator,), denominator = ss2tf(discrete.A, discrete.B, discrete.C, discrete.D)
    return np.asarray(lfilter(numerator, denominator, u))
