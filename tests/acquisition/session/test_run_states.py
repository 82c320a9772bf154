"""Every state with every event, in one table: what follows, and whether the arm is stopped."""

import pytest

from acquisition.session.control import BROKEN, OVER, BrokenOffError, RunControl, RunEvent, RunState, after

IDLE, RUNNING, PAUSING, BREAKING, PAUSED, ENDING, ABORTING, DONE, ABORTED, HALTED = RunState
# START PAUSE BREAK RESUME STOP ABORT HALT CHECKPOINT FINISHED FAULT
TABLE = {
    IDLE: (RUNNING, IDLE, IDLE, IDLE, IDLE, IDLE, HALTED, IDLE, IDLE, IDLE),
    RUNNING: (RUNNING, PAUSING, BREAKING, RUNNING, ENDING, ABORTING, HALTED, RUNNING, DONE, ABORTED),
    PAUSING: (PAUSING, PAUSING, BREAKING, RUNNING, ENDING, ABORTING, HALTED, PAUSED, DONE, ABORTED),
    BREAKING: (BREAKING, BREAKING, BREAKING, BREAKING, BREAKING, ABORTING, HALTED, PAUSED, DONE, ABORTED),
    PAUSED: (PAUSED, PAUSED, PAUSED, RUNNING, DONE, ABORTED, HALTED, PAUSED, PAUSED, ABORTED),
    ENDING: (ENDING, PAUSING, BREAKING, ENDING, ENDING, ABORTING, HALTED, DONE, DONE, ABORTED),
    ABORTING: (ABORTING, ABORTING, ABORTING, ABORTING, ABORTING, ABORTING, HALTED, ABORTED, ABORTED, ABORTED),
    DONE: (RUNNING, DONE, DONE, DONE, DONE, DONE, HALTED, DONE, DONE, DONE),
    ABORTED: (ABORTED, ABORTED, ABORTED, ABORTED, ABORTED, ABORTED, HALTED, ABORTED, ABORTED, ABORTED),
    HALTED: (HALTED,) * 10,
}
WAYS = {  # from IDLE to each state, by events alone
    IDLE: (),
    RUNNING: (RunEvent.START,),
    PAUSING: (RunEvent.START, RunEvent.PAUSE),
    BREAKING: (RunEvent.START, RunEvent.BREAK),
    PAUSED: (RunEvent.START, RunEvent.PAUSE, RunEvent.CHECKPOINT),
    ENDING: (RunEvent.START, RunEvent.STOP),
    ABORTING: (RunEvent.START, RunEvent.ABORT),
    DONE: (RunEvent.START, RunEvent.FINISHED),
    ABORTED: (RunEvent.START, RunEvent.FAULT),
    HALTED: (RunEvent.HALT,),
}
PAIRS = [
    pytest.param(state, event, TABLE[state][k], id=f"{state.name}-{event.name}")
    for state in RunState
    for k, event in enumerate(RunEvent)
]


@pytest.mark.parametrize(("state", "event", "then"), PAIRS)
def test_every_pair(state: RunState, event: RunEvent, then: RunState) -> None:
    assert after(state, event) is then
    stops: list[int] = []
    control = RunControl(lambda: stops.append(1))
    for before in WAYS[state]:
        control.tell(before)
    assert control.state is state
    stops.clear()
    control.tell(event)
    assert control.state is then
    # A halt always stops the arm; else it is stopped on the way into a state in which nothing may move.
    assert bool(stops) is (event is RunEvent.HALT or (then in BROKEN and then is not state))


def test_what_is_over_lets_no_motion_go_on_by_itself() -> None:
    for state in OVER:
        assert all(after(state, event) in OVER for event in RunEvent if event is not RunEvent.START)


@pytest.mark.parametrize("state", RunState)
def test_however_often_ctrl_c_comes_no_motion_begins_by_it_and_three_end_a_session(state: RunState) -> None:
    control = RunControl(lambda: None)
    for before in WAYS[state]:
        control.tell(before)
    for _ in range(3):
        now = control.state
        control.interrupt()
        assert control.state is not RUNNING
        assert not (now in BROKEN and control.state not in BROKEN)
    assert control.state in (OVER if state in OVER else (ABORTING, ABORTED, HALTED))


@pytest.mark.parametrize("state", [IDLE, DONE])
@pytest.mark.parametrize("times", [1, 2, 3])
def test_ctrl_c_before_measuring_begins_holds_it_before_its_first_motion(state: RunState, times: int) -> None:
    control = RunControl(lambda: None)
    for before in WAYS[state]:
        control.tell(before)
    for _ in range(times):
        control.interrupt()
    control.tell(RunEvent.START)
    assert control.state is (PAUSING if times < 3 else ABORTING)
    with pytest.raises(BrokenOffError):
        control.check(begins=True)


def test_a_pause_that_was_taken_back_before_measuring_begins_holds_nothing() -> None:
    control = RunControl(lambda: None)
    control.pause()
    control.resume()
    control.tell(RunEvent.START)
    assert control.state is RUNNING
