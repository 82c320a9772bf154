"""Time left, from the pace so far: time in which the arm worked, over the poses that it took."""

from drivers.clock import Clock

ENOUGH = 3  # poses: before, the first search for the light would be taken for the usual


class Pace:
    """Counts working time; what a person is waited for does not count."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._since_s: float | None = None
        self._worked_s = 0.0
        self._poses = 0

    def work(self, working: bool) -> None:
        """The arm works from now on, or it waits. Said again, it changes nothing."""
        if working and self._since_s is None:
            self._since_s = self._clock.now_s()
        elif not working and self._since_s is not None:
            self._worked_s += self._clock.now_s() - self._since_s
            self._since_s = None

    def taken(self) -> None:
        """One more pose."""
        self._poses += 1

    def left_s(self, poses: int) -> float | None:
        """For so many more; None while nobody can tell."""
        if self._poses < ENOUGH:
            return None
        running_s = 0.0 if self._since_s is None else self._clock.now_s() - self._since_s
        return poses * (self._worked_s + running_s) / self._poses


def clock_words(seconds: float) -> str:
    """In words as "1 h 05 min", "12 min", "40 s": no finer than anybody plans by."""
    if seconds < 60.0:
        return f"{max(5, 5 * round(seconds / 5.0)):.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
