"""Every state with every event: the whole table, so that a new state cannot be forgotten."""

import pytest

from acquisition.motion.states import OVER, MotionEvent, MotionState, after

S, E = MotionState, MotionEvent
CHANGES = {
    **{(s, E.START): S.MOVING for s in OVER},
    **{(s, E.HALT): S.HALTED for s in MotionState},
    **{(s, e): S.ENDING for s in (S.MOVING, S.PAUSING, S.HELD) for e in (E.ABORT, E.STOP)},
    **{(s, E.FAULT): S.ABORTED for s in (S.MOVING, S.PAUSING, S.HELD, S.ENDING)},
    **{(s, E.FINISHED): S.DONE for s in (S.MOVING, S.PAUSING, S.ENDING)},
    **{(s, E.HOLD): S.HELD for s in (S.MOVING, S.PAUSING)},
    **{(s, E.RESUME): S.MOVING for s in (S.PAUSING, S.HELD)},
    (S.MOVING, E.PAUSE): S.PAUSING,
    (S.PAUSING, E.RESTED): S.HELD,
}


@pytest.mark.parametrize("state", MotionState)
@pytest.mark.parametrize("event", MotionEvent)
def test_what_follows(state: MotionState, event: MotionEvent) -> None:
    assert after(state, event) is CHANGES.get((state, event), state)
