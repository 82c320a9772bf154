"""By how much an arm follows its set-points: what was sent beside what was heard, both by the host's clock.

heard(t) = sent(t) - lag d(sent)/dt, the first term of Taylor's series: good while the lag is short against the blends.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from calibeam.motion.robot import StreamedArm
from drivers.clock import Clock

Floats = NDArray[np.float64]

LEAST_SPEED_RAD_S = 0.02  # of a joint, where it is judged: slower ones say nothing


@dataclass
class KeptSetPoints:
    """Implements acquisition.motion.following.SetPoints on a controller, and remembers what that was sent."""

    arm: StreamedArm
    clock: Clock
    _sent: list[tuple[float, Floats]] = field(default_factory=list[tuple[float, Floats]])

    def servo_joints(self, q_rad: Floats, period_s: float, lookahead_s: float, gain: float) -> None:
        self._sent.append((self.clock.now_s(), q_rad.copy()))
        self.arm.servo_joints(q_rad, period_s, lookahead_s, gain)

    def servo_stop(self, deceleration_rad_s2: float) -> None:
        self.arm.servo_stop(deceleration_rad_s2)

    def stop(self) -> None:
        self.arm.stop()

    def clear(self) -> None:
        self._sent.clear()

    def sent(self) -> tuple[Floats, Floats]:
        """Host time (set-point,) and joints (set-point, joint)."""
        return np.array([t_s for t_s, _ in self._sent]), np.array([q_rad for _, q_rad in self._sent])


def lag_s(sent_s: Floats, sent_rad: Floats, heard_s: Floats, heard_rad: Floats) -> float:
    """By least squares over all joints that move; NaN where none does. Times (n,), joints (n, joint)."""
    later = np.diff(sent_s, prepend=-np.inf) > 0.0  # after a pause set-points may bear one time
    sent_s, sent_rad = sent_s[later], sent_rad[later]
    inside = (heard_s > sent_s[0]) & (heard_s < sent_s[-1])
    at_s = heard_s[inside]
    slope = np.gradient(sent_rad, sent_s, axis=0)
    sent = np.stack([np.interp(at_s, sent_s, column) for column in sent_rad.T], axis=1)
    speed = np.stack([np.interp(at_s, sent_s, column) for column in slope.T], axis=1)
    moves = np.abs(speed) > LEAST_SPEED_RAD_S
    if not moves.any():
        return float("nan")
    behind = (sent - heard_rad[inside])[moves]
    return float(behind @ speed[moves] / (speed[moves] @ speed[moves]))
