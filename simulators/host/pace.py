"""When the next tick is due: emulated time runs at a fixed rate of wall time, and never jumps.

A little lateness is caught up. A stall of more than STALL_S (the machine slept, or is too slow for the rate) is not:
emulated time lags from then on, so that no client sees a burst of time. Pure arithmetic: the caller reads the clock.
"""

STALL_S = 0.050  # wall time; longer than any scheduling delay of a working machine, shorter than a client's time-outs


class Pace:
    """Deadlines of ticks, in the wall time of whoever asks."""

    def __init__(self, tick_wall_s: float, now_s: float) -> None:
        self._tick_wall_s = tick_wall_s
        self.next_s = now_s
        self.stalls = 0
        self.lost_s = 0.0  # wall time that emulated time has not followed

    def take(self, now_s: float) -> bool:
        """True when a tick is due now; counts it as run."""
        late_s = now_s - self.next_s
        if late_s < 0.0:
            return False
        if late_s > STALL_S:
            self.stalls += 1
            self.lost_s += late_s
            self.next_s = now_s
        self.next_s += self._tick_wall_s
        return True
