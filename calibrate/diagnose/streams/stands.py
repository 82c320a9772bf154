"""When the arm was asked to stand: stretches in which the set-point does not change."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams.track import Track

Floats = NDArray[np.float64]

SHORTEST_S = 0.1
MOVING_RAD_S = 1e-3  # 60 µrad/s in 60 ms: slower than any motion of a program, faster than noise of a reading


@dataclass(frozen=True)
class Stand:
    """`moved` (channel,): change of the set-point in the motion before; zero for the first."""

    from_s: float
    to_s: float
    moved: Floats


def stands_of(setpoint: Track) -> tuple[Stand, ...]:
    """Stands of at least SHORTEST_S; of the set-point, or of joints as read: both are flat while the arm stands."""
    setpoint = setpoint.read()
    if len(setpoint.time_s) < 3:
        return ()
    span = max(1, round(0.03 / max(setpoint.period_s, 1e-4)))
    change = np.abs(setpoint.values[span:] - setpoint.values[:-span]).max(axis=1, initial=0.0)
    taken_s = setpoint.time_s[span:] - setpoint.time_s[:-span]
    moving = np.zeros(len(setpoint.time_s), dtype=bool)
    fast = change > MOVING_RAD_S * np.maximum(taken_s, 1e-9)
    moving[:-span] |= fast  # from its first sample to its last: a change within the span belongs to the motion
    moving[span:] |= fast
    edges = np.flatnonzero(np.diff(np.concatenate([[1], moving.astype(int), [1]])))
    out: list[Stand] = []
    before = None
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        at = setpoint.values[begin:end].mean(axis=0)
        # a stand is widened by the span that moving was widened by, but not over a change
        begin, end = _widened(setpoint, int(begin), int(end), span, at)
        from_s, to_s = float(setpoint.time_s[begin]), float(setpoint.time_s[end - 1])
        if to_s - from_s >= SHORTEST_S:
            out.append(Stand(from_s, to_s, np.zeros_like(at) if before is None else at - before))
            before = at
    return tuple(out)


def _widened(setpoint: Track, begin: int, end: int, span: int, at: Floats) -> tuple[int, int]:
    lowest, highest = max(0, begin - span), min(len(setpoint.time_s), end + span)
    near = np.abs(setpoint.values[lowest:highest] - at).max(axis=1) <= MOVING_RAD_S * 0.03
    first, last = begin, end
    while first > lowest and near[first - 1 - lowest]:
        first -= 1
    while last < highest and near[last - lowest]:
        last += 1
    return first, last
