"""The one gate that every motion goes through: planned first, then streamed, and stopped by whoever asks.

gate = Gate(solver, pace, cell, arm, stream, clock)
made = gate.plan(start_rad, segments)          # dry run: refuses before anything moves
gate.run(made)                                 # blocks; pause, hold, resume, abort, stop, halt from any thread

A plan belongs to the gate that made it; only the last one may be run, and only from where it begins.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.cell import Cell
from acquisition.motion.errors import InterruptedMotionError, RefusedMotionError
from acquisition.motion.inverse.solver import Solver
from acquisition.motion.paths.path import STANDING
from acquisition.motion.paths.segments import Pace, Segment
from acquisition.motion.paths.solved import SolvedPath
from acquisition.motion.plan import BeltAt, Plan, plan
from acquisition.motion.setpoints import BeltNow, Followable, LookAhead
from acquisition.motion.states import OVER, PAUSE_AGAIN_S, Event, State, after
from drivers.clock import Clock
from drivers.errors import DeviceRefused

Floats = NDArray[np.float64]
Acting = Callable[[str], None]

HALTED = "the motion was halted; the arm was stopped through its controller"
PIPELINE = 4  # solutions that are made before the set-points come to them: the path must rest so long for an action
ELSEWHERE_RAD = 1e-3  # an arm further from where its plan begins was moved meanwhile


class SetPoints(Protocol):
    """The streaming half of a robot controller; `stop` works from any thread and in every state."""

    def servo_joints(self, q_rad: Floats, period_s: float, lookahead_s: float, gain: float) -> None: ...
    def servo_stop(self, deceleration_rad_s2: float) -> None: ...
    def stop(self) -> None: ...


@dataclass(frozen=True)
class Stream:
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


class Gate:
    """The one owner of a motion's state."""

    def __init__(self, solver: Solver, pace: Pace, cell: Cell, arm: SetPoints, stream: Stream, clock: Clock) -> None:
        self._solver, self._pace, self._cell = solver, pace, cell
        self._arm, self._stream, self._clock = arm, stream, clock
        self._lock = threading.RLock()  # a signal handler may come in the middle of itself
        self._state = State.IDLE
        self._paused_s = -np.inf
        self._made: Plan | None = None
        self._wanted_end = State.DONE

    @property
    def state(self) -> State:
        return self._state

    def plan(self, start_rad: Floats, segments: Sequence[Segment], belt: BeltAt = lambda t_s: STANDING) -> Plan:
        """Goes through the motion without moving. RefusedMotionError names what is wrong with it."""
        rest_s = PIPELINE / self._stream.solve_hz
        resting = [replace(s, time_s=s.time_s + rest_s) if s.action else s for s in segments]
        self._made = plan(self._solver, start_rad, resting, self._pace, self._cell, belt)
        return self._made

    # --- what a person may say, from any thread and in every state

    def pause(self) -> None:
        """At the next rest; a second time within 10 s: at once."""
        now_s = self._clock.now_s()
        again = now_s - self._paused_s <= PAUSE_AGAIN_S
        self._paused_s = now_s
        self._tell(Event.HOLD if again and self._state is State.PAUSING else Event.PAUSE)

    def hold(self) -> None:
        """Brake on the path, and stay ready to go on."""
        self._tell(Event.HOLD)

    def resume(self) -> None:
        """Go on along the path."""
        self._tell(Event.RESUME)

    def abort(self) -> None:
        """Brake within the limits and give up; `run` raises InterruptedMotionError."""
        self._end(Event.ABORT, State.ABORTED)

    def stop(self) -> None:
        """Brake within the limits and end as a success."""
        self._end(Event.STOP, State.DONE)

    def halt(self) -> None:
        """Stop the arm now, through the controller, whatever the state. DeviceError where that fails."""
        self._tell(Event.HALT)
        self._arm.stop()

    # --- the motion

    def run(
        self,
        made: Plan,
        now_rad: Floats,
        belt: BeltNow = lambda: STANDING,
        act: Acting = lambda action: None,
        watch: Callable[[], None] = lambda: None,
    ) -> Followed:
        """Streams the plan to the arm, which stands at `now_rad`; blocks until it rests again, whatever happens.

        `act` is called where the path rests for an action; `watch` once a cycle, and raises what has failed.
        RefusedMotionError: not planned by this gate, or the arm stands elsewhere. InterruptedMotionError: aborted,
        halted, or set-points too late. DeviceError of the arm.
        """
        self._check(made, now_rad)
        self._tell(Event.START)
        followed = Followed()
        try:
            # Solving takes a while: whatever is said meanwhile counts, for the motion has begun.
            path = made.path() if made.carried else SolvedPath(made.path(), 1.0 / self._stream.solve_hz)
            self._follow(made, path, belt, act, watch, followed)
            if self._halted():
                self._arm.stop()  # once more: a set-point may have crossed the halt on its way
            else:
                self._arm.servo_stop(self._brake_rad_s2)
        except BaseException as error:  # also Ctrl-C, and in the middle of the clean-up
            self._tell(Event.FAULT)
            self._arm.stop()
            if isinstance(error, DeviceRefused) and self._halted():  # a set-point that came after the halt
                raise InterruptedMotionError(HALTED) from error
            raise
        if self._halted():
            raise InterruptedMotionError(HALTED)
        if self._state is State.ABORTED:
            raise InterruptedMotionError("the motion was aborted; the arm stands")
        return followed

    def _halted(self) -> bool:
        return self._state is State.HALTED

    @property
    def _brake_rad_s2(self) -> float:
        return float(np.min(self._pace.acceleration_rad_s2))

    def _check(self, made: Plan, now_rad: Floats) -> None:
        if made is not self._made:
            raise RefusedMotionError("this plan was not the last one made by this gate; plan again before running it")
        if self._state not in OVER:
            raise RefusedMotionError(f"a motion is under way ({self._state.value}); wait for its end, or stop it")
        off = np.abs(now_rad - made.start_rad)
        if np.max(off) > ELSEWHERE_RAD:
            joint = int(np.argmax(off))
            raise RefusedMotionError(
                f"joint {joint + 1} stands {np.degrees(off[joint]):.2f} deg from where the plan begins; plan again"
            )

    def _follow(
        self, made: Plan, path: Followable, belt: BeltNow, act: Acting, watch: Callable[[], None], followed: Followed
    ) -> None:
        points = LookAhead(path, self._stream.solve_hz, belt, made.start_rad, self._stream.lag_s)
        period_s, begin_s, cycle = 1.0 / self._stream.hz, self._clock.now_s(), 0
        acted, before_rad, speed_rad_s = 0, made.start_rad, np.zeros_like(made.start_rad)
        while self._state not in OVER:
            watch()
            if self._state is State.ENDING:
                self._brake(before_rad, speed_rad_s, begin_s, cycle, followed)
                return
            self._ramp(points, period_s)
            late_s = self._wait(begin_s + cycle * period_s, cycle, followed)
            watch()  # again: most of a cycle is spent waiting, and nothing may be sent after a halt
            if self._halted():
                return
            begin_s += late_s
            if late_s > self._stream.rested_s:
                points.restart((cycle - 1) * period_s)
                followed.restarts += 1
            q_rad = points.at(cycle * period_s)
            self._send(q_rad, followed)
            speed_rad_s, before_rad, cycle = (q_rad - before_rad) / period_s, q_rad, cycle + 1
            actions = points.path.actions
            if acted < len(actions) and points.reached_s >= actions[acted][0]:
                act(actions[acted][1])
                begin_s = self._clock.now_s() - cycle * period_s  # an action takes what it takes: the arm rests
                acted += 1
                self._tell(Event.RESTED)
                points.scale = 0.0 if self._state is State.HELD else points.scale
            if points.reached_s >= points.path.ends_s:
                self._tell(Event.FINISHED)

    def _ramp(self, points: LookAhead, period_s: float) -> None:
        """Path time slows down to a hold, and up again after it, within the acceleration of every joint."""
        brake_s = float(np.max(self._pace.speed_rad_s / self._pace.acceleration_rad_s2))
        wanted = 0.0 if self._state is State.HELD else 1.0
        change = period_s / brake_s
        points.scale += float(np.clip(wanted - points.scale, -change, change))

    def _brake(self, q_rad: Floats, speed_rad_s: Floats, begin_s: float, cycle: int, followed: Followed) -> None:
        """All joints to rest together, at constant deceleration; needs no path and no inverse kinematics."""
        period_s = 1.0 / self._stream.hz
        total_s = float(np.max(np.abs(speed_rad_s) / self._pace.acceleration_rad_s2))
        steps = int(np.ceil(total_s / period_s))
        for k in range(1, steps + 1):
            if self._state is not State.ENDING:
                return
            t_s = min(k * period_s, total_s)
            begin_s += self._wait(begin_s + (cycle + k - 1) * period_s, cycle + k - 1, followed)
            if self._halted():
                return
            self._send(q_rad + speed_rad_s * (t_s - 0.5 * t_s**2 / total_s), followed)
        with self._lock:
            if self._state is State.ENDING:
                self._state = self._wanted_end

    def _wait(self, due_s: float, cycle: int, followed: Followed) -> float:
        """Until a set-point is due; by how much (s) the path has to wait because cycles were missed."""
        late_s = self._clock.now_s() - due_s
        period_s = 1.0 / self._stream.hz
        if late_s < 0.0:
            self._clock.sleep_s(-late_s)
        if late_s <= period_s:
            return 0.0
        if late_s > self._stream.late_s:
            raise InterruptedMotionError(
                f"set-point {cycle} came {1e3 * late_s:.0f} ms late (limit {1e3 * self._stream.late_s:.0f} ms); the "
                "arm was stopped: free this machine of other work, or lower the solving rate"
            )
        followed.missed += int(late_s / period_s)
        followed.worst_late_s = max(followed.worst_late_s, late_s)
        return late_s

    def _send(self, q_rad: Floats, followed: Followed) -> None:
        self._arm.servo_joints(q_rad, 1.0 / self._stream.hz, self._stream.lookahead_s, self._stream.gain)
        followed.sent += 1

    def _end(self, event: Event, end: State) -> None:
        """The first one that ends a motion says how; a stop after an abort does not make a success of it."""
        with self._lock:
            if self._state is not State.ENDING:
                self._wanted_end = end
            self._tell(event)

    def _tell(self, event: Event) -> None:
        with self._lock:
            self._state = after(self._state, event)
