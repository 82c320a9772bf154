"""The one gate that every motion goes through: planned first, then streamed, and stopped by whoever asks.

gate = Gate(solver, pace, cell, arm, stream, clock)
made = gate.plan(start_rad, segments)          # dry run: refuses before anything moves
gate.run(made)                                 # blocks; pause, hold, resume, abort, stop, halt from any thread

A plan belongs to the gate that made it; only the last one may be run, and only from where it begins.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import InterruptedMotionError, RefusedMotionError
from acquisition.motion.cell import Cell
from acquisition.motion.following import Followed, Following, Said, SetPoints, SetPointStream
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.paths.path import STANDING
from acquisition.motion.paths.segments import By, Pace, Segment
from acquisition.motion.plan import BeltAt, Plan, plan
from acquisition.motion.setpoints import BeltNow, LookAhead, SolvedPath
from acquisition.motion.states import OVER, PAUSE_AGAIN_S, REST_S, Acting, MotionEvent, MotionState, after
from acquisition.motion.under_way import UnderWay
from drivers.clock import Clock
from drivers.errors import DeviceRefused

Floats = NDArray[np.float64]

HALTED = "the motion was halted; the arm was stopped through its controller"
PIPELINE = 4  # solutions that are made before the set-points come to them: a path that rests must rest so long
DISPLACED_RAD = 1e-3  # an arm further from where its plan begins was moved meanwhile


class Gate:
    """The one owner of a motion's state."""

    def __init__(
        self, solver: Solver, pace: Pace, cell: Cell, arm: SetPoints, stream: SetPointStream, clock: Clock
    ) -> None:
        self._solver, self._pace, self._cell = solver, pace, cell
        self._arm, self._stream, self._clock = arm, stream, clock
        self._lock = threading.RLock()  # a signal handler may come in the middle of itself
        self._state = MotionState.IDLE
        self._paused_s = -np.inf
        self._points: LookAhead | None = None
        self._made: Plan | None = None
        self._wanted_end = MotionState.DONE

    @property
    def state(self) -> MotionState:
        return self._state

    @property
    def solver(self) -> Solver:
        """The kinematics that plans are made with."""
        return self._solver

    def plan(self, start_rad: Floats, segments: Sequence[Segment], belt: BeltAt = lambda t_s: STANDING) -> Plan:
        """Goes through the motion without moving. RefusedMotionError names what is wrong with it."""
        rest_s = PIPELINE / self._stream.solve_hz
        resting = [replace(s, time_s=s.time_s + rest_s) if s.by is By.STAND else s for s in segments]
        self._made = plan(self._solver, start_rad, resting, self._pace, self._cell, belt)
        return self._made

    # --- commands of a person, from any thread and in every state

    def pause(self) -> None:
        """At the next rest, or braking along the path where that is further than REST_S; again within 10 s: at once."""
        now_s = self._clock.now_s()
        again = now_s - self._paused_s <= PAUSE_AGAIN_S
        self._paused_s = now_s
        at_once = again and self._state is MotionState.PAUSING
        self._tell(MotionEvent.HOLD if at_once or self.rests_in_s() > REST_S else MotionEvent.PAUSE)

    def rests_in_s(self) -> float:
        """Until the next rest of the path, or its end, at the planned speed; 0 where nothing moves."""
        points = self._points
        if points is None or self._state not in (MotionState.MOVING, MotionState.PAUSING):
            return 0.0
        here_s = points.reached_s
        rests_s = [t_s for t_s, _ in points.path.rests if t_s > here_s]
        return max(0.0, min([*rests_s, points.path.ends_s]) - here_s)

    @property
    def brake_s(self) -> float:
        """How long braking along the path takes from full speed, with what is solved ahead."""
        pace = self._pace
        return float(np.max(pace.speed_rad_s / pace.acceleration_rad_s2)) + PIPELINE / self._stream.solve_hz

    def hold(self) -> None:
        """Brake on the path, and stay ready to go on."""
        self._tell(MotionEvent.HOLD)

    def resume(self) -> None:
        """Go on along the path."""
        self._tell(MotionEvent.RESUME)

    def abort(self) -> None:
        """Brake within the limits and give up; `run` raises InterruptedMotionError."""
        self._end(MotionEvent.ABORT, MotionState.ABORTED)

    def stop(self) -> None:
        """Brake within the limits and end as a success."""
        self._end(MotionEvent.STOP, MotionState.DONE)

    def halt(self) -> None:
        """Stop the arm now, through the controller, whatever the state. DeviceError where that fails."""
        self._tell(MotionEvent.HALT)
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

        `act` is called where the path rests for an action, in a thread of its own, and may take its time: the stream
        goes on meanwhile, so that the hand stays with its belt. `watch` is called twice a cycle, and raises what has
        failed. RefusedMotionError: not planned by this gate, or the arm stands elsewhere. InterruptedMotionError:
        aborted, halted, set-points too late, or one that leaves limits, speed or cell. DeviceError of the arm.
        """
        self._check(made, now_rad)
        self._tell(MotionEvent.START)
        try:
            following = self._following(made, belt)
            if self._state is MotionState.PAUSING:  # while it was solved
                self._tell(MotionEvent.HOLD)
            following.run(made.start_rad, act, watch)
            if self._halted():
                self._arm.stop()  # once more: a set-point may have crossed the halt on its way
            else:
                self._arm.servo_stop(self._brake_rad_s2)
        except BaseException as error:  # also Ctrl-C, and in the middle of the clean-up
            self._tell(MotionEvent.FAULT)
            self._arm.stop()
            if isinstance(error, DeviceRefused) and self._halted():  # a set-point that came after the halt
                raise InterruptedMotionError(HALTED) from error
            raise
        finally:
            self._points = None
        if self._halted():
            raise InterruptedMotionError(HALTED)
        if self._state is MotionState.ABORTED:
            raise InterruptedMotionError("the motion was aborted; the arm stands")
        return following.followed

    def _following(self, made: Plan, belt: BeltNow) -> Following:
        """Solving takes a while: whatever is commanded meanwhile counts, for the motion has begun."""
        path = made.path() if made.carried else SolvedPath(made.path(), 1.0 / self._stream.solve_hz)
        self._points = points = LookAhead(path, self._stream.solve_hz, belt, made.start_rad, self._stream.lag_s)
        checked = UnderWay(self._solver.arm, self._pace, self._cell, made.start_rad, 1.0 / self._stream.hz)
        said = Said(lambda: self._state, self._tell, self._braked)
        return Following(self._arm, self._stream, self._clock, points, checked, self._pace, said)

    def _braked(self) -> None:
        with self._lock:
            if self._state is MotionState.ENDING:
                self._state = self._wanted_end

    def _halted(self) -> bool:
        return self._state is MotionState.HALTED

    @property
    def _brake_rad_s2(self) -> float:
        return float(np.min(self._pace.acceleration_rad_s2))

    def _check(self, made: Plan, now_rad: Floats) -> None:
        if made is not self._made:
            raise RefusedMotionError("this plan was not the last one made by this gate; plan again before running it")
        if self._state not in OVER:
            raise RefusedMotionError(f"a motion is under way ({self._state.value}); wait for its end, or stop it")
        off = np.abs(now_rad - made.start_rad)
        if np.max(off) > DISPLACED_RAD:
            joint = int(np.argmax(off))
            raise RefusedMotionError(
                f"joint {joint + 1} stands {np.degrees(off[joint]):.2f}° from where the plan begins; plan again"
            )

    def _end(self, event: MotionEvent, end: MotionState) -> None:
        """The first one that ends a motion decides how; a stop after an abort does not make a success of it."""
        with self._lock:
            if self._state is not MotionState.ENDING:
                self._wanted_end = end
            self._tell(event)

    def _tell(self, event: MotionEvent) -> None:
        with self._lock:
            self._state = after(self._state, event)
