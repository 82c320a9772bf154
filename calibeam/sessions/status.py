"""What is known of a running session at this moment, and who is informed of it.

Time left comes from the pace so far: time in which the arm worked, over the poses that it took. Quality is that of the
samples so far: spots, settling, and how much of the joints' ranges they have been at.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.reading import Coverage
from acquisition.session.control import RunState
from acquisition.session.records import Progress, Sample
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
        """The arm works from now on, or it waits. Reported again, it changes nothing."""
        if working and self._since_s is None:
            self._since_s = self._clock.now_s()
        elif not working and self._since_s is not None:
            self._worked_s += self._clock.now_s() - self._since_s
            self._since_s = None

    def taken(self) -> None:
        """One more pose."""
        self._poses += 1

    def left_s(self, poses: int) -> float | None:
        """For so many more; None while it is unknown."""
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


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Forecast:
    """Lengths are rms, one sigma of the identified geometry, as in `calibeam design`."""

    samples: int
    goal_m: float
    now_m: float | None = None  # None: not determined, see `why`
    more: int | None = None  # poses of the plan until the goal, 0: reached; None: not by this plan
    end_m: float | None = None  # when all of the plan is taken
    why: str = ""  # no number yet
    corrections: dict[str, float] | None = None  # fitted values by parameter name

    @property
    def says(self) -> str:
        """One sentence for a person."""
        if self.now_m is None:
            return f"not determined yet: {self.why}"
        now, goal = _microns(self.now_m), _microns(self.goal_m)
        if self.more == 0:
            return f"{now}: under {goal}"
        if self.more is not None:
            return f"{now}; {self.more} more poses bring it under {goal}"
        end = "" if self.end_m is None else f"; the whole plan brings it to {_microns(self.end_m)}, not under {goal}"
        return f"{now}{end}"


def _microns(length_m: float) -> str:
    return f"{1e6 * length_m:.3g} µm" if length_m < 1e-3 else f"{1e3 * length_m:.2g} mm"


@dataclass(frozen=True, eq=False)
class Quality:
    """For the eye; a session decides nothing by it."""

    samples: int
    unsettled: int
    settle_s: float | None  # of the last sample
    usual_settle_s: float | None  # median of all
    spots_m: Floats  # (4,) of the last sample
    sums_v: tuple[float, float]  # light on both faces
    spans_rad: Floats  # (joint,) widest way between two samples
    marks: tuple[str, ...]  # a joint's range step by step: acquisition/guided/reading.py


class QualityKeeper:
    """Counts; owned by one session."""

    def __init__(self, lower_rad: Floats, upper_rad: Floats) -> None:
        self._coverage = Coverage(lower_rad, upper_rad)
        self._settle_s: list[float] = []
        self._q_rad: list[Floats] = []
        self._unsettled = 0

    def add(self, sample: Sample) -> Quality:
        """One more sample; how things stand with it."""
        look = sample.look
        self._coverage.add(look.q_rad)
        self._q_rad.append(look.q_rad)
        self._unsettled += not look.settled
        if look.settle_s is not None:
            self._settle_s.append(look.settle_s)
        return Quality(
            len(self._q_rad),
            self._unsettled,
            look.settle_s,
            float(np.median(self._settle_s)) if self._settle_s else None,
            look.spots_m(),
            (look.psd1.sum_v, look.psd2.sum_v),
            np.ptp(np.array(self._q_rad), axis=0),
            tuple(self._coverage.marks(joint) for joint in range(len(look.q_rad))),
        )


UNDELIVERED = "stop not delivered, press the red emergency stop"


@dataclass(frozen=True)
class SessionStatus:
    """None: nothing yet."""

    state: RunState = RunState.IDLE
    step: str = ""  # "4 of 7  measure"
    progress: Progress | None = None
    left_s: float | None = None
    quality: Quality | None = None
    forecast: Forecast | None = None
    asked: str = ""  # what a person is waited for
    undelivered: str = ""  # why the arm could not be stopped

    @property
    def head(self) -> str:
        """What is going on, in a word or two."""
        if self.undelivered:
            return UNDELIVERED
        if self.asked:
            return "your turn"
        if self.state is RunState.RUNNING and self.progress is not None:
            return self.progress.phase.value
        return self.state.value


class Listener(Protocol):
    """Terminal, log file or page. Called from several threads, one at a time; never raises."""

    def report(self, text: str, on_screen: bool) -> None:
        """One line; those that are not for the screen stand in the log alone."""
        ...

    def shows(self, shown: SessionStatus) -> None:
        """At every change."""
        ...
