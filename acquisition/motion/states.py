"""What a motion can be doing, what can happen to it, and what it then does: one table, words as in bluesky.

pause: at the next rest of the path; the gate makes it a hold where that is further than REST_S, and so a second one
within PAUSE_AGAIN_S. resume goes on.
abort: brake, clean up, end as aborted. stop: brake, clean up, end as a success. halt: stop the arm, no clean-up.
Source of the words and keys: bluesky, "Interrupting" (first Ctrl-C: pause at the next checkpoint; second within 10 s:
pause now).
"""

import enum

PAUSE_AGAIN_S = 10.0
REST_S = 1.0


class MotionState(enum.Enum):
    """The value is the sentence for a person."""

    IDLE = "nothing moves"
    MOVING = "on the path"
    PAUSING = "on the path until its next rest"
    HELD = "braked on the path, or resting on it; may go on"
    ENDING = "braking for good, then cleaning up"
    DONE = "arrived, or stopped as a success"
    ABORTED = "given up; the arm stands"
    HALTED = "stopped without clean-up"


class MotionEvent(enum.Enum):
    """What a person, a device or the path itself says."""

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
