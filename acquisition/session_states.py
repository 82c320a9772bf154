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
    # A stop would let the motion go on that is being broken off: it is to be said once the arm stands.
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
