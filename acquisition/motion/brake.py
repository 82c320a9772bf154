"""To rest within the acceleration of every joint: along the path where it stands still, else by the joints alone."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.paths.path import STANDING
from acquisition.motion.setpoints import Followable, OnPath

Floats = NDArray[np.float64]

PROBE_S = 1e-3  # of path time, over which the speed of the joints along the path is read off


def along_path(path: Followable, at: OnPath, acceleration_rad_s2: Floats, period_s: float) -> Iterator[Floats]:
    """Set-points (joint,) from a place on a path that can be asked for any time: the tool stays on its way.

    Path time runs ever slower: in each period by what the joint with the least room can bear, its speed along the path
    being q' (joint,) and its deceleration q' ds'/dt.
    """
    t_s, rate = at.t_s, at.rate
    while rate > 0.0:
        along = np.abs(path.at(t_s + PROBE_S, STANDING) - path.at(t_s, STANDING)) / PROBE_S
        room = float(np.max(along / acceleration_rad_s2))
        slower = max(0.0, rate - period_s / room) if room > 0.0 else 0.0
        t_s += 0.5 * (rate + slower) * period_s
        rate = slower
        yield path.at(t_s, STANDING)


def by_joints(q_rad: Floats, speed_rad_s: Floats, acceleration_rad_s2: Floats, period_s: float) -> Iterator[Floats]:
    """Set-points (joint,) from a set-point and its speed: all joints in one time, at constant deceleration.

    Needs neither path nor inverse kinematics. Leaves the belt; a way that was straight bends by y^2 / (8 R).
    """
    total_s = float(np.max(np.abs(speed_rad_s) / acceleration_rad_s2))
    for k in range(1, int(np.ceil(total_s / period_s)) + 1):
        t_s = min(k * period_s, total_s)
        yield q_rad + speed_rad_s * (t_s - 0.5 * t_s**2 / total_s)
