"""How an arm goes through a session: set-points on an even grid of true time, its stops, what its servos make of them.

Trapezoids of speed from stop to stop; each joint follows as a critically damped servo of second order.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

Floats = NDArray[np.float64]
STEP_S = 1e-3
SPEED_RAD_S = 1.2  # of the fastest joint of a move
SHORTEST_S = 0.3
STAND_S = 0.9
SERVO_HZ = 25.0
RAMP = 0.25  # of the time, each of speeding up and of braking


@dataclass(frozen=True, eq=False)
class Course:
    """The arm begins in a stop at the first pose."""

    time_s: Floats  # (step,)
    command_rad: Floats  # (step, n)
    q_rad: Floats  # (step, n) shafts
    stops_s: Floats  # (pose,) when the set-point arrives

    def at(self, values: Floats, time_s: Floats) -> Floats:
        """(row, ...) of what is known on the grid."""
        return np.stack([np.interp(time_s, self.time_s, channel) for channel in values.T], axis=1)

    def since_stop(self) -> tuple[NDArray[np.intp], Floats]:
        """(step,) the latest stop, and the time since."""
        last = np.maximum(np.searchsorted(self.stops_s, self.time_s, side="right") - 1, 0)
        return last, np.maximum(self.time_s - self.stops_s[last], 0.0)


def course(poses_rad: Floats) -> Course:
    """Through all poses (pose, n), with a stop at each."""
    pieces, stops_s, now_s = [np.tile(poses_rad[0], (round(STAND_S / STEP_S), 1))], [0.0], STAND_S
    for start, goal in pairwise(poses_rad):
        lasts = max(round(float(np.max(np.abs(goal - start))) / SPEED_RAD_S / STEP_S), round(SHORTEST_S / STEP_S))
        share = _trapezoid(np.arange(lasts) / lasts)
        pieces += [start + share[:, np.newaxis] * (goal - start), np.tile(goal, (round(STAND_S / STEP_S), 1))]
        stops_s.append(now_s + STEP_S * lasts)
        now_s += STEP_S * lasts + STAND_S
    command = np.concatenate(pieces)
    time_s = STEP_S * np.arange(len(command), dtype=np.float64)
    return Course(time_s, command, _served(command), np.array(stops_s))


def swung(u: Floats, frequency_hz: float, damping: float) -> Floats:
    """(step, channel) x of x'' + 2 z w x' + w^2 x = w^2 u from rest, u held over each step.

    Matrix exponential of state and held input: Franklin, Powell, Workman, "Digital Control", section 4.3.
    """
    w = 2.0 * np.pi * frequency_hz
    A = np.array([[0.0, 1.0, 0.0], [-w * w, -2.0 * damping * w, w * w], [0.0, 0.0, 0.0]])
    step = np.asarray(expm(A * STEP_S), dtype=np.float64)
    a, b = step[:2, :2], step[:2, 2]
    poles = np.array([1.0, -np.trace(a), np.linalg.det(a)])
    zeros = np.array([0.0, b[0], a[0, 1] * b[1] - a[1, 1] * b[0]])
    return np.asarray(lfilter(zeros, poles, u, axis=0), dtype=np.float64)


def _served(command: Floats) -> Floats:
    return command[0] + swung(command - command[0], SERVO_HZ, 1.0)


def _trapezoid(share: Floats) -> Floats:
    """Way done after a share of the time."""
    top = 1.0 / (1.0 - RAMP)
    up = 0.5 * top / RAMP * np.minimum(share, RAMP) ** 2
    late = np.clip(share - 1.0 + RAMP, 0.0, RAMP)
    return up + top * np.clip(share - RAMP, 0.0, 1.0 - 2.0 * RAMP) + top * late - 0.5 * top / RAMP * late**2
