"""Who holds a session: pause, resume, stop, abort, halt, said from any thread; the session asks at every checkpoint.

The arm is stopped by whoever says so, not by the session, which may be waiting for that very motion. A stop can fall
between the session's last look at the reins and its next motion: so it is said again until the session has taken note.
"""

import threading
from collections.abc import Callable

from acquisition.errors import StoppedError
from acquisition.session_states import BROKEN, OVER, PAUSE_AGAIN_S, Event, State, after
from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceError

WAKE_S = 0.1  # of a paused session, to see whether a device has failed meanwhile


class BrokenOffError(Exception):
    """The step under way was broken off by a pause, and is to be done again: no fault of any device."""


class EndedEarlyError(Exception):
    """A person has enough samples: the session ends here, as a success."""


class Reins:
    """Owner of a session's state. `stop_arm` works from any thread; DeviceError where it cannot be delivered.

    `failure`: what has gone wrong with a device, so that a pause does not outlast it. `hold_arm`: stops for good, after
    abort and halt. `undelivered`: told of a stop that could not be delivered; None: there is none of these any more.
    """

    def __init__(
        self,
        stop_arm: Callable[[], None],
        clock: Clock | None = None,
        failure: Callable[[], Exception | None] = lambda: None,
        changed: Callable[[State], None] = lambda state: None,
        hold_arm: Callable[[], None] | None = None,
        undelivered: Callable[[DeviceError | None], None] = lambda trouble: None,
    ) -> None:
        self._stop_arm, self._failure, self._changed = stop_arm, failure, changed
        self._hold_arm, self._undelivered = hold_arm or stop_arm, undelivered
        self._clock: Clock = clock or SystemClock()
        self._news = threading.Condition()
        self._state = State.IDLE
        self._paused_s = float("-inf")
        self.trouble: DeviceError | None = None  # why the last stop could not be delivered

    @property
    def state(self) -> State:
        return self._state

    # --- what a person may say, from any thread and in every state

    def interrupt(self) -> None:
        """Ctrl-C: pause; again within 10 s: at once; while paused: abort."""
        if self._state is State.PAUSED:
            self.abort()
        else:
            self.pause()

    def pause(self) -> None:
        """At the next checkpoint; a second time within PAUSE_AGAIN_S: at once."""
        now_s = self._clock.now_s()
        again = now_s - self._paused_s <= PAUSE_AGAIN_S
        self._paused_s = now_s
        self.tell(Event.BREAK if again and self._state in (State.PAUSING, State.ENDING) else Event.PAUSE)

    def resume(self) -> None:
        """Go on from the last checkpoint."""
        self._paused_s = float("-inf")
        if self._state is State.PAUSED:
            self._keep(None)  # the arm stands, whatever became of the stop
        self.tell(Event.RESUME)

    def stop(self) -> None:
        """End at the next checkpoint, as a success."""
        self.tell(Event.STOP)

    def abort(self) -> None:
        """Stop the arm and give the session up."""
        self.tell(Event.ABORT)

    def halt(self) -> None:
        """Stop the arm now, whatever the state."""
        self.tell(Event.HALT)

    def insist(self) -> None:
        """Say the stop once more while the session has not taken note; to be called a few times a second."""
        state = self._state
        if state in BROKEN:
            self._brake(state)

    def tell(self, event: Event) -> None:
        """Any event; where it stops the arm, the arm has been told when this returns."""
        with self._news:
            before, self._state = self._state, after(self._state, event)
            now = self._state
            self._news.notify_all()
        if event is Event.HALT or (now in BROKEN and now is not before):
            self._brake(now)
        if now is not before:
            self._changed(self._state)  # which may have gone on while the arm was being stopped

    # --- what the session asks

    def checkpoint(self) -> bool:
        """Between two samples: waits while paused; whether it did.

        EndedEarlyError, StoppedError when a person has ended the session; and whatever a device has failed with.
        """
        self.tell(Event.CHECKPOINT)
        waited = False
        with self._news:
            while self._state is State.PAUSED and self._failure() is None:
                waited = True
                self._news.wait(WAKE_S)
        self.check_devices()
        self._raise_end()
        return waited

    def check_devices(self) -> None:
        """Raises what a device has failed with; the session is over then."""
        failure = self._failure()
        if failure is not None:
            self.tell(Event.FAULT)
            raise failure

    def finish(self) -> None:
        """The plan is at its end. StoppedError where a person gave it up in the last moment."""
        self.tell(Event.FINISHED)
        if self._state in (State.ABORTED, State.HALTED):
            self._raise_end()

    def check(self) -> None:
        """Before and after every motion. BrokenOffError where the step is broken off; StoppedError."""
        if self._state is State.HALTED:
            self._raise_end()
        if self._state in BROKEN:
            raise BrokenOffError

    def _raise_end(self) -> None:
        if self._state in (State.ABORTED, State.HALTED):
            raise StoppedError(f"the session was {self._state.value}")
        if self._state in OVER:
            raise EndedEarlyError

    def _brake(self, state: State) -> None:
        trouble = None
        try:
            (self._stop_arm if state is State.BREAKING else self._hold_arm)()
        except DeviceError as error:
            trouble = error
        self._keep(trouble)

    def _keep(self, trouble: DeviceError | None) -> None:
        before, self.trouble = self.trouble, trouble
        if str(before) != str(trouble):  # it is said again and again, and is news once
            self._undelivered(trouble)
