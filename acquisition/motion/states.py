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


class State(enum.Enum):
    """The value is the sentence for a person."""

    IDLE = "nothing moves"
    MOVING = "on the path"
    PAUSING = "on the path until its next rest"
    HELD = "braked on the path, or resting on it; may go on"
    ENDING = "braking for good, then cleaning up"
    DONE = "arrived, or stopped as a success"
    ABORTED = "given up; the arm stands"
    HALTED = "stopped without clean-up"


class Event(enum.Enum):
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


OVER = (State.IDLE, State.DONE, State.ABORTED, State.HALTED)  # nothing is under way

_UNDER_WAY = {
    Event.ABORT: State.ENDING,
    Event.STOP: State.ENDING,
    Event.HALT: State.HALTED,
    Event.FAULT: State.ABORTED,
}
_TABLE: dict[State, dict[Event, State]] = {
    **{state: {Event.START: State.MOVING, Event.HALT: State.HALTED} for state in OVER},
    State.MOVING: {**_UNDER_WAY, Event.PAUSE: State.PAUSING, Event.HOLD: State.HELD, Event.FINISHED: State.DONE},
    State.PAUSING: {
        **_UNDER_WAY,
        Event.HOLD: State.HELD,
        Event.RESUME: State.MOVING,
        Event.RESTED: State.HELD,
        Event.FINISHED: State.DONE,
    },
    State.HELD: {**_UNDER_WAY, Event.RESUME: State.MOVING},
    State.ENDING: {Event.HALT: State.HALTED, Event.FAULT: State.ABORTED, Event.FINISHED: State.DONE},
}


def after(state: State, event: Event) -> State:
    """The state that follows; an event that means nothing in a state leaves it as it is."""
    return _TABLE[state].get(event, state)
