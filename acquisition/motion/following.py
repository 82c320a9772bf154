"""One plan on its way to the arm: set-points in time and checked, rests and actions, holds, the brake.

To rest within the acceleration of every joint: along the path where it stands still, else by the joints alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import InterruptedMotionError, RefusedMotionError
from acquisition.motion.paths.path import STANDING
from acquisition.motion.paths.segments import Pace
from acquisition.motion.setpoints import Followable, LookAhead, OnPath, SolvedPath
from acquisition.motion.states import OVER, Acting, Action, MotionEvent, MotionState
from acquisition.motion.under_way import UnderWay
from drivers.clock import Clock

Floats = NDArray[np.float64]

PASSED_EVERY = 20  # set-points; in 40 ms no shift that matters goes unseen
PROBE_S = 1e-3  # of path time, over which the speed of the joints along the path is read off


class SetPoints(Protocol):
    """The streaming half of a robot controller; `stop` works from any thread and in every state."""

    def servo_joints(self, q_rad: Floats, period_s: float, lookahead_s: float, gain: float) -> None: ...
    def servo_stop(self, deceleration_rad_s2: float) -> None: ...
    def stop(self) -> None: ...


@dataclass(frozen=True)
class SetPointStream:
    """How set-points go out. `solve_hz` from the structure, `hz` of the controller."""

    hz: float = 500.0  # UR e-Series control cycle
    solve_hz: float = 100.0
    lookahead_s: float = 0.03  # URScript servoj: 0.03 to 0.2 s; the least smooths least
    gain: float = 2000.0  # URScript servoj: 100 to 2000; the stiffest follows best
    lag_s: float = 0.0  # by which the arm follows its set-points, as measured by `calibeam motion`; 0: nobody has
    rested_s: float = 0.02  # after so long a silence the arm rests on the last set-point, and is set going from there
    late_s: float = 1.0  # a stream that was silent longer is given up


@dataclass
class Followed:
    """How a run went."""

    sent: int = 0
    missed: int = 0  # cycles in which no set-point could be sent in time
    worst_late_s: float = 0.0
    restarts: int = 0  # the stream was silent so long that the arm came to rest
    from_s: float = 0.0  # host time of the first set-point, and of the last
    to_s: float = 0.0
    cut_short: bool = False  # a stop ended it before the end of its path
    passed: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])  # clock and path time (s)


@dataclass(frozen=True)
class Said:
    """The gate, as the stream sees it. `braked`: the brake is at its end."""

    state: Callable[[], MotionState]
    tell: Callable[[MotionEvent], None]
    braked: Callable[[], None]


class Following:
    """The one owner of a stream, from its first set-point to its last."""

    def __init__(
        self,
        arm: SetPoints,
        stream: SetPointStream,
        clock: Clock,
        points: LookAhead,
        checked: UnderWay,
        pace: Pace,
        said: Said,
    ) -> None:
        self._arm, self._stream, self._clock, self._points, self._said = arm, stream, clock, points, said
        self._checked, self._pace, self._period_s = checked, pace, 1.0 / stream.hz
        self._brake_s = float(np.max(pace.speed_rad_s / pace.acceleration_rad_s2))
        self._begin_s, self._cycle = clock.now_s(), 0
        self._q_rad = self._speed_rad_s = np.empty(0)  # of the set-point that was sent last
        self._action: Action | None = None
        self._rested = 0
        self.followed = Followed()

    def run(self, start_rad: Floats, act: Acting, watch: Callable[[], None]) -> None:
        """Until the motion is over; InterruptedMotionError where a set-point may not be sent, or comes too late."""
        self._q_rad, self._speed_rad_s = start_rad, np.zeros_like(start_rad)
        while self._said.state() not in OVER:
            watch()
            if self._said.state() is MotionState.ENDING:
                self._brake(watch)
                return
            self._ramp()
            late_s = self._wait()
            watch()  # again: most of a cycle is spent waiting, and nothing may be sent after a halt
            if self._said.state() is MotionState.HALTED:
                return
            if late_s > self._stream.rested_s:
                self._points.restart((self._cycle - 1) * self._period_s)
                self.followed.restarts += 1
            self._send(self._next())
            self._rest(act)
            if self._points.reached_s >= self._points.path.ends_s:
                self._said.tell(MotionEvent.FINISHED)

    def _next(self) -> Floats:
        try:
            return self._points.at(self._cycle * self._period_s)
        except RefusedMotionError as why:  # solved while it is followed: the belt leads out of reach
            raise InterruptedMotionError(f"{why}; the arm was stopped") from why

    def _ramp(self) -> None:
        """Path time slows down to a hold, and up again after it, within the acceleration of every joint."""
        waits = self._said.state() is MotionState.HELD or self._action is not None
        change = self._period_s / self._brake_s
        self._points.scale += float(np.clip((0.0 if waits else 1.0) - self._points.scale, -change, change))

    def _rest(self, act: Acting) -> None:
        """Where the path rests: an action, for which path time stands still while the stream goes on, or a pause."""
        rests = self._points.path.rests
        if self._action is not None:
            if self._action.over():
                self._action = None
                self._go_on()
        elif self._rested < len(rests) and self._points.reached_s >= rests[self._rested][0]:
            name = rests[self._rested][1]
            self._rested += 1
            if name:
                self._points.scale, self._action = 0.0, Action(act, name)
            else:
                self._go_on()

    def _go_on(self) -> None:
        """At once: the path rests, so that no joint feels it."""
        self._said.tell(MotionEvent.RESTED)
        self._points.scale = 0.0 if self._said.state() is MotionState.HELD else 1.0

    def _brake(self, watch: Callable[[], None]) -> None:
        acceleration = self._pace.acceleration_rad_s2
        if isinstance(self._points.path, SolvedPath):
            at = self._points.on_path((self._cycle - 1) * self._period_s)
            steps = along_path(self._points.path, at, acceleration, self._period_s)
        else:
            steps = by_joints(self._q_rad, self._speed_rad_s, acceleration, self._period_s)
        for q_rad in steps:
            self._wait()
            watch()
            if self._said.state() is not MotionState.ENDING:
                return
            self._send(q_rad)
        self.followed.cut_short = True
        self._said.braked()

    def _wait(self) -> float:
        """Until a set-point is due; by how much (s) the path has to wait because cycles were missed."""
        late_s = self._late_s()
        if late_s < 0.0:
            self._clock.sleep_s(-late_s)
            self._late_s()  # a freeze of this program may have fallen into the wait: then nothing more is sent
        if late_s <= self._period_s:
            return 0.0
        self.followed.missed += int(late_s / self._period_s)
        self.followed.worst_late_s = max(self.followed.worst_late_s, late_s)
        self._begin_s += late_s
        return late_s

    def _late_s(self) -> float:
        """Since the next set-point was due; negative before. InterruptedMotionError: late by more than the limit."""
        late_s = self._clock.now_s() - (self._begin_s + self._cycle * self._period_s)
        if late_s > self._stream.late_s:
            raise InterruptedMotionError(
                f"set-point {self._cycle} came {1e3 * late_s:.0f} ms late (limit {1e3 * self._stream.late_s:.0f} ms); "
                "the arm was stopped: this program was suspended, or the machine has too much other work"
            )
        return late_s

    def _send(self, q_rad: Floats) -> None:
        now_s = self._clock.now_s()
        self._checked.check(q_rad, now_s)
        if self.followed.sent % PASSED_EVERY == 0:
            passed_s, known = self._points.on_path(self._cycle * self._period_s).t_s, self.followed.passed
            if len(known) < 2 or passed_s > known[-2][1]:  # of a hold its begin and its end are enough
                known.append((now_s, passed_s))
            else:
                known[-1] = now_s, passed_s
        self._arm.servo_joints(q_rad, self._period_s, self._stream.lookahead_s, self._stream.gain)
        self._speed_rad_s, self._q_rad = (q_rad - self._q_rad) / self._period_s, q_rad
        self._cycle += 1
        self.followed.from_s, self.followed.to_s = self.followed.from_s if self.followed.sent else now_s, now_s
        self.followed.sent += 1


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
