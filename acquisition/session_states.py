"""What a session can be doing, what can happen to it, and what it then does: one table, words as in bluesky.

pause: the arm rests within REST_S, at the end of the motion under way or braked softly, and no further motion begins;
the pose is taken again later. Again within PAUSE_AGAIN_S: at once, the arm is stopped. resume goes on from the last
checkpoint. stop: ends at the next checkpoint, as a success; a pause takes precedence over it. abort: the arm is stopped
and held, what was taken is kept, the session has failed to end as asked. halt: the arm is stopped and held, whatever
the state. A pause or an abort from before measuring begins takes effect at its beginning.
Source of words and keys: bluesky, "Interrupting" (first Ctrl-C: pause at the next checkpoint; second within 10 s: now).
"""

import enum

PAUSE_AGAIN_S = 10.0
REST_S = 1.0  # a motion that ends sooner is let arrive, and braked softly else


class State(enum.Enum):
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


class Event(enum.Enum):
    """What a person, a device or the session itself says."""

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


OVER = (State.IDLE, State.DONE, State.ABORTED, State.HALTED)  # nothing is under way
BROKEN = (State.BREAKING, State.ABORTING, State.HALTED)  # no motion may go on, and none may begin

_UNDER_WAY = {
    Event.BREAK: State.BREAKING,
    Event.STOP: State.ENDING,
    Event.ABORT: State.ABORTING,
    Event.HALT: State.HALTED,
    Event.FINISHED: State.DONE,
    Event.FAULT: State.ABORTED,
}
_TABLE: dict[State, dict[Event, State]] = {
    State.IDLE: {Event.START: State.RUNNING, Event.HALT: State.HALTED},
    State.DONE: {Event.START: State.RUNNING, Event.HALT: State.HALTED},
    State.ABORTED: {Event.HALT: State.HALTED},
    State.HALTED: {},
    State.RUNNING: {**_UNDER_WAY, Event.PAUSE: State.PAUSING},
    State.PAUSING: {**_UNDER_WAY, Event.RESUME: State.RUNNING, Event.CHECKPOINT: State.PAUSED},
    # A stop would let the motion go on that is being broken off: it is to be said once the arm stands.
    State.BREAKING: {**_UNDER_WAY, Event.CHECKPOINT: State.PAUSED, Event.STOP: State.BREAKING},
    State.PAUSED: {
        Event.RESUME: State.RUNNING,
        Event.STOP: State.DONE,
        Event.ABORT: State.ABORTED,
        Event.HALT: State.HALTED,
        Event.FAULT: State.ABORTED,
    },
    State.ENDING: {**_UNDER_WAY, Event.PAUSE: State.PAUSING, Event.CHECKPOINT: State.DONE},
    State.ABORTING: {
        Event.HALT: State.HALTED,
        Event.CHECKPOINT: State.ABORTED,
        Event.FINISHED: State.ABORTED,
        Event.FAULT: State.ABORTED,
    },
}


def after(state: State, event: Event) -> State:
    """The state that follows; an event that means nothing in a state leaves it as it is."""
    return _TABLE[state].get(event, state)
