"""Run control of a session: pause, resume, stop, abort, halt from any thread; the session asks at every checkpoint.

The arm is stopped by whoever calls, not by the session, which may be waiting for that very motion. A stop can fall
between the session's last look and its next motion: so it is repeated until the session has taken note.

One table lists what a session can be doing, what can happen to it, and what it then does, in the words of bluesky:
pause: the arm rests within REST_S, at the end of the motion under way or braked softly, and no further motion begins;
the pose is taken again later. Again within PAUSE_AGAIN_S: at once, the arm is stopped. resume goes on from the last
checkpoint. stop: ends at the next checkpoint, as a success; a pause takes precedence over it. abort: the arm is stopped
and held, what was taken is kept, the session has failed to end as asked. halt: the arm is stopped and held, whatever
the state. A pause or an abort from before measuring begins takes effect at its beginning.
Source of words and keys: bluesky, "Interrupting" (first Ctrl-C: pause at the next checkpoint; second within 10 s: now).
"""

import enum
import threading
from collections.abc import Callable
from typing import TypeVar

from acquisition.errors import StoppedError
from drivers.clock import Clock, SystemClock
from drivers.device import Floats
from drivers.errors import DeviceError

Result = TypeVar("Result")

PAUSE_AGAIN_S = 10.0
REST_S = 1.0  # a motion that ends sooner is let arrive, and braked softly else


class RunState(enum.Enum):
    """The value is what a person reads, in large letters."""

    IDLE = "ready"
    RUNNING = "measuring"
    PAUSING = "pausing, the arm comes to rest"
    BREAKING = "stopping the arm"
    PAUSED = "paused, the arm stands"
    ENDING = "ending after this pose"
    ABORTING = "aborting, stopping the arm"
    DONE = "done"
    ABORTED = "aborted, the arm stands"
    HALTED = "halted, the arm is held"


class RunEvent(enum.Enum):
    """What comes from a person, a device or the session itself."""

    START = "measuring begins, or begins again"
    PAUSE = "pause"
    BREAK = "pause at once"
    RESUME = "resume"
    STOP = "stop"
    ABORT = "abort"
    HALT = "halt"
    CHECKPOINT = "the session is between two samples, and the arm stands"
    FINISHED = "the plan is at its end"
    FAULT = "a device failed"


OVER = (RunState.IDLE, RunState.DONE, RunState.ABORTED, RunState.HALTED)  # nothing is under way
BROKEN = (RunState.BREAKING, RunState.ABORTING, RunState.HALTED)  # no motion may go on, and none may begin

_UNDER_WAY = {
    RunEvent.BREAK: RunState.BREAKING,
    RunEvent.STOP: RunState.ENDING,
    RunEvent.ABORT: RunState.ABORTING,
    RunEvent.HALT: RunState.HALTED,
    RunEvent.FINISHED: RunState.DONE,
    RunEvent.FAULT: RunState.ABORTED,
}
_TABLE: dict[RunState, dict[RunEvent, RunState]] = {
    RunState.IDLE: {RunEvent.START: RunState.RUNNING, RunEvent.HALT: RunState.HALTED},
    RunState.DONE: {RunEvent.START: RunState.RUNNING, RunEvent.HALT: RunState.HALTED},
    RunState.ABORTED: {RunEvent.HALT: RunState.HALTED},
    RunState.HALTED: {},
    RunState.RUNNING: {**_UNDER_WAY, RunEvent.PAUSE: RunState.PAUSING},
    RunState.PAUSING: {**_UNDER_WAY, RunEvent.RESUME: RunState.RUNNING, RunEvent.CHECKPOINT: RunState.PAUSED},
    # A stop would let the motion go on that is being broken off: it is to be sent once the arm stands.
    RunState.BREAKING: {**_UNDER_WAY, RunEvent.CHECKPOINT: RunState.PAUSED, RunEvent.STOP: RunState.BREAKING},
    RunState.PAUSED: {
        RunEvent.RESUME: RunState.RUNNING,
        RunEvent.STOP: RunState.DONE,
        RunEvent.ABORT: RunState.ABORTED,
        RunEvent.HALT: RunState.HALTED,
        RunEvent.FAULT: RunState.ABORTED,
    },
    RunState.ENDING: {**_UNDER_WAY, RunEvent.PAUSE: RunState.PAUSING, RunEvent.CHECKPOINT: RunState.DONE},
    RunState.ABORTING: {
        RunEvent.HALT: RunState.HALTED,
        RunEvent.CHECKPOINT: RunState.ABORTED,
        RunEvent.FINISHED: RunState.ABORTED,
        RunEvent.FAULT: RunState.ABORTED,
    },
}


def after(state: RunState, event: RunEvent) -> RunState:
    """The state that follows; an event that means nothing in a state leaves it as it is."""
    return _TABLE[state].get(event, state)


WAKE_S = 0.1  # of a paused session, to see whether a device has failed meanwhile


class BrokenOffError(Exception):
    """The step under way was broken off by a pause, and is to be done again: no fault of any device."""


class EndedEarlyError(Exception):
    """A person has enough samples: the session ends here, as a success."""


class RunControl:
    """Owner of a session's state. `stop_arm` works from any thread; DeviceError where it cannot be delivered.

    `failure`: what has gone wrong with a device, so that a pause does not outlast it. `hold_arm`: stops for good, after
    abort and halt. `undelivered`: informed of a stop that could not be delivered; None: there is none of these any
    more. `rests_in_s`: when the motion under way ends; 0: nothing moves. `ease_arm`: brakes softly. `pausing`: called
    with the time until the arm rests after a pause (s, at most), and whether it brakes for that.
    """

    def __init__(
        self,
        stop_arm: Callable[[], None],
        clock: Clock | None = None,
        failure: Callable[[], Exception | None] = lambda: None,
        changed: Callable[[RunState], None] = lambda state: None,
        hold_arm: Callable[[], None] | None = None,
        undelivered: Callable[[DeviceError | None], None] = lambda trouble: None,
        rests_in_s: Callable[[], float] = lambda: 0.0,
        ease_arm: Callable[[], None] | None = None,
        pausing: Callable[[float, bool], None] = lambda rests_in_s, eased: None,
    ) -> None:
        self._stop_arm, self._failure, self._changed = stop_arm, failure, changed
        self._hold_arm, self._undelivered = hold_arm or stop_arm, undelivered
        self._rests_in_s, self._ease_arm, self._pausing = rests_in_s, ease_arm or stop_arm, pausing
        self._eased = False  # the motion under way was braked softly, and the session has not taken note
        self._easing: threading.Thread | None = None
        self._early: RunEvent | None = None  # pause or abort, from before measuring began
        self._interrupts, self._interrupted_s = 0, float("-inf")
        self._why = ""
        self._clock: Clock = clock or SystemClock()
        self._news = threading.Condition()
        self._state = RunState.IDLE
        self._paused_s = float("-inf")
        self.trouble: DeviceError | None = None  # why the last stop could not be delivered

    @property
    def state(self) -> RunState:
        return self._state

    # --- commands of a person, from any thread and in every state

    def interrupt(self) -> None:
        """Ctrl-C: pause; again within 10 s: at once; a third one, or one long after the arm stands: abort."""
        now_s = self._clock.now_s()
        self._interrupts = self._interrupts + 1 if now_s - self._interrupted_s <= PAUSE_AGAIN_S else 1
        self._interrupted_s = now_s
        if self._interrupts > 2 or (self._state is RunState.PAUSED and self._interrupts == 1):
            self.abort()
        elif self._state is not RunState.PAUSED:
            self.pause()

    def pause(self) -> None:
        """The arm rests within REST_S and begins no further motion; a second time within PAUSE_AGAIN_S: at once."""
        now_s, before = self._clock.now_s(), self._state
        again = now_s - self._paused_s <= PAUSE_AGAIN_S
        self._paused_s = now_s
        if again and before is RunState.PAUSING:
            self.tell(RunEvent.BREAK)
            return
        self.tell(RunEvent.PAUSE)
        if before in (RunState.RUNNING, RunState.ENDING):
            rests_in_s = self._rests_in_s()
            self._pausing(rests_in_s, rests_in_s > REST_S)
            self._ease(rests_in_s)

    def resume(self) -> None:
        """Go on from the last checkpoint."""
        self._paused_s = self._interrupted_s = float("-inf")
        if self._state is RunState.PAUSED:
            self._keep(None)  # the arm stands, whatever became of the stop
        self.tell(RunEvent.RESUME)

    def stop(self) -> None:
        """End at the next checkpoint, as a success."""
        self.tell(RunEvent.STOP)

    def abort(self, why: str = "") -> None:
        """Stop the arm and give the session up."""
        self._why = self._why or why
        self.tell(RunEvent.ABORT)

    def halt(self) -> None:
        """Stop the arm now, whatever the state."""
        self.tell(RunEvent.HALT)

    def insist(self) -> None:
        """Send the stop once more while the session has not taken note; to be called a few times a second."""
        state = self._state
        if state in BROKEN:
            self._brake(state)
        elif state is RunState.PAUSING:
            self._ease(self._rests_in_s())

    def tell(self, event: RunEvent) -> None:
        """Any event; where it stops the arm, the arm has the command when this returns."""
        with self._news:
            before, now = self._state, after(self._state, event)
            if before in (RunState.IDLE, RunState.DONE):
                if now is RunState.RUNNING and self._early is not None:
                    now = after(now, self._early)
                if event in (RunEvent.START, RunEvent.RESUME):
                    self._early = None
                elif event is RunEvent.ABORT or (event is RunEvent.PAUSE and self._early is None):
                    self._early = event
            self._state = now
            self._news.notify_all()
        if event is RunEvent.HALT or (now in BROKEN and now is not before):
            self._brake(now)
        if now is not before:
            self._changed(self._state)  # which may have gone on while the arm was being stopped

    # --- what the session asks

    def checkpoint(self) -> bool:
        """Between two samples: waits while paused; whether it did.

        EndedEarlyError, StoppedError when a person has ended the session; and whatever a device has failed with.
        """
        if self._easing is not None:
            self._easing.join()  # a stop that arrives late would end the next motion
            self._easing = None
        self.tell(RunEvent.CHECKPOINT)
        self._eased = waited = False
        with self._news:
            while self._state is RunState.PAUSED and self._failure() is None:
                waited = True
                self._news.wait(WAKE_S)
        self.check_devices()
        self._raise_end()
        return waited

    def check_devices(self) -> None:
        """Raises what a device has failed with; the session is over then."""
        failure = self._failure()
        if failure is not None:
            self.tell(RunEvent.FAULT)
            raise failure

    def finish(self) -> None:
        """The plan is at its end. StoppedError where a person gave it up in the last moment."""
        self.tell(RunEvent.FINISHED)
        if self._state in (RunState.ABORTED, RunState.HALTED):
            self._raise_end()

    def check(self, *, begins: bool = False) -> None:
        """Before (`begins`) and after every motion. BrokenOffError where the step is broken off; StoppedError."""
        if self._state is RunState.HALTED:
            self._raise_end()
        if self._state in BROKEN or self._eased or (begins and self._state is RunState.PAUSING):
            raise BrokenOffError

    def step(self, act: Callable[[], Result], come_back: Callable[[], None], astray: Callable[[], None]) -> Result:
        """What `act` gives, once it was done without being broken off; before it is done again, and after every pause,
        `come_back`; `astray` where it was broken off. Raises what ends a session.
        """
        waited = False
        while True:
            waited = self.checkpoint() or waited
            try:
                if waited:
                    come_back()
                    waited = False
                return act()
            except BrokenOffError:
                astray()
                waited = True

    def move(self, move: Callable[[Floats], None], q_rad: Floats) -> None:
        """A motion that a person may break off. Raises as `check`, and what `move` raises."""
        self.check(begins=True)
        try:
            move(q_rad)
        except DeviceError:
            self.check()  # it was the pause that ended the motion
            raise
        self.check()  # an arm that arrived before the stop came counts as broken off all the same

    def _raise_end(self) -> None:
        if self._state in (RunState.ABORTED, RunState.HALTED):
            why = f"{self._why}: " if self._why else ""
            raise StoppedError(f"{why}the session was {self._state.value}")
        if self._state in OVER:
            raise EndedEarlyError

    def _ease(self, rests_in_s: float) -> None:
        """A motion that outlasts its pause is braked, whatever was expected: an operator may slow the arm down."""
        outlasts = rests_in_s > 0.0 and self._clock.now_s() - self._paused_s > REST_S
        if not self._eased and (rests_in_s > REST_S or outlasts):
            self._eased = True  # before the arm stops, for the session notices that at once
            # A thread of its own: who commands it must be heard again while the arm brakes.
            self._easing = threading.Thread(target=self._deliver, args=(self._ease_arm,), name="ease", daemon=True)
            self._easing.start()

    def _brake(self, state: RunState) -> None:
        self._deliver(self._stop_arm if state is RunState.BREAKING else self._hold_arm)

    def _deliver(self, stop: Callable[[], None]) -> None:
        trouble = None
        try:
            stop()
        except DeviceError as error:
            trouble = error
        self._keep(trouble)

    def _keep(self, trouble: DeviceError | None) -> None:
        before, self.trouble = self.trouble, trouble
        if str(before) != str(trouble):  # it is reported again and again, and is news once
            self._undelivered(trouble)
