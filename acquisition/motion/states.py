"""What a motion can be doing, what can happen to it, and what it then does: one table, words as in bluesky.

pause: at the next rest of the path; the gate makes it a hold where that is further than REST_S, and so a second one
within PAUSE_AGAIN_S. resume goes on.
abort: brake, clean up, end as aborted. stop: brake, clean up, end as a success. halt: stop the arm, no clean-up.
Source of the words and keys: bluesky, "Interrupting" (first Ctrl-C: pause at the next checkpoint; second within 10 s:
pause now).

An action of a program runs beside the stream: a hand takes its time, and the arm goes on being sent where to stand. On
a belt it has to: an arm whose set-points stop stands, and the belt takes the part away from the hand.
"""

import enum
import threading
from collections.abc import Callable

Acting = Callable[[str], None]


class Action:
    """One GRASP or RELEASE under way. A motion that is ended meanwhile does not wait for it."""

    def __init__(self, act: Acting, name: str) -> None:
        self._act, self._name = act, name
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=f"action {name}", daemon=True)
        self._thread.start()

    def over(self) -> bool:
        """Whether it is done. Raises what went wrong in it."""
        if self._thread.is_alive():
            return False
        if self._failure is not None:
            raise self._failure
        return True

    def _run(self) -> None:
        try:
            self._act(self._name)
        except BaseException as failure:  # handed to the stream, which stops the arm
            self._failure = failure


PAUSE_AGAIN_S = 10.0
REST_S = 1.0


class MotionState(enum.Enum):
    """The value is the sentence for a person."""

    IDLE = "nothing moves"
    MOVING = "on the path"
    PAUSING = "on the path until its next rest"
    HELD = "braked on the path, or resting on it; may go on"
    ENDING = "braking for good, then cleaning up"
    DONE = "arrived"
    ABORTED = "given up; the arm stands"
    HALTED = "stopped without clean-up"


class MotionEvent(enum.Enum):
    """What comes from a person, a device or the path itself."""

    START = "start"
    PAUSE = "pause"
    HOLD = "hold"
    RESUME = "resume"
    ABORT = "abort"
    STOP = "stop"
    HALT = "halt"
    RESTED = "the path rests"
    FINISHED = "the path is at its end, or the brake is"
    FAULT = "a device failed, or set-points were late"


OVER = (MotionState.IDLE, MotionState.DONE, MotionState.ABORTED, MotionState.HALTED)  # nothing is under way

_UNDER_WAY = {
    MotionEvent.ABORT: MotionState.ENDING,
    MotionEvent.STOP: MotionState.ENDING,
    MotionEvent.HALT: MotionState.HALTED,
    MotionEvent.FAULT: MotionState.ABORTED,
}
_TABLE: dict[MotionState, dict[MotionEvent, MotionState]] = {
    **{state: {MotionEvent.START: MotionState.MOVING, MotionEvent.HALT: MotionState.HALTED} for state in OVER},
    MotionState.MOVING: {
        **_UNDER_WAY,
        MotionEvent.PAUSE: MotionState.PAUSING,
        MotionEvent.HOLD: MotionState.HELD,
        MotionEvent.FINISHED: MotionState.DONE,
    },
    MotionState.PAUSING: {
        **_UNDER_WAY,
        MotionEvent.HOLD: MotionState.HELD,
        MotionEvent.RESUME: MotionState.MOVING,
        MotionEvent.RESTED: MotionState.HELD,
        MotionEvent.FINISHED: MotionState.DONE,
    },
    MotionState.HELD: {**_UNDER_WAY, MotionEvent.RESUME: MotionState.MOVING},
    MotionState.ENDING: {
        MotionEvent.HALT: MotionState.HALTED,
        MotionEvent.FAULT: MotionState.ABORTED,
        MotionEvent.FINISHED: MotionState.DONE,
    },
}


def after(state: MotionState, event: MotionEvent) -> MotionState:
    """The state that follows; an event that means nothing in a state leaves it as it is."""
    return _TABLE[state].get(event, state)
