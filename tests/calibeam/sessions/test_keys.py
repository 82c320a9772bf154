"""Keys and signals reach the run control, and the terminal is given back as it was."""

import os
import pty
import select
import signal
import termios
import threading
import tty
from collections.abc import Callable

import pytest

from acquisition.errors import StoppedError
from acquisition.session.control import RunControl, RunEvent, RunState
from calibeam.sessions.keys import ENTER, Keys
from drivers.errors import DeviceLost

PATIENCE_S = 10.0


class Followed:
    """A run control that tells when they come into a state."""

    def __init__(self) -> None:
        self._came = {state: threading.Event() for state in RunState}
        self.states: list[RunState] = []
        self.control = RunControl(lambda: None, changed=self._changed)
        self.control.tell(RunEvent.START)

    def _changed(self, state: RunState) -> None:
        self.states.append(state)
        self._came[state].set()

    def comes_to(self, state: RunState) -> bool:
        return self._came[state].wait(PATIENCE_S)


@pytest.fixture
def followed() -> Followed:
    return Followed()


@pytest.fixture
def terminal():
    ours, theirs = pty.openpty()
    yield ours, theirs
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("typed", "state"),
    [(" ", RunState.PAUSING), ("p", RunState.PAUSING), ("PP", RunState.BREAKING), ("s", RunState.ENDING),
     ("A", RunState.ABORTING), ("h", RunState.HALTED), ("pr", RunState.RUNNING), ("x", RunState.RUNNING)],
)  # fmt: skip
def test_every_key(followed, typed, state) -> None:
    keys = Keys(followed.control, None)
    for key in typed:
        keys.pressed(key)
    assert followed.control.state is state


def test_keys_come_without_enter_and_the_terminal_is_as_it_was(followed, terminal) -> None:
    ours, theirs = terminal
    before = termios.tcgetattr(theirs)
    with Keys(followed.control, theirs):
        assert not termios.tcgetattr(theirs)[3] & termios.ICANON
        os.write(ours, b" ")
        assert followed.comes_to(RunState.PAUSING)
    assert termios.tcgetattr(theirs) == before


def test_arrows_and_function_keys_mean_nothing(followed, terminal) -> None:
    """Up, Home, F3, wheel: else abort, halt, resume, abort."""
    with Keys(followed.control, terminal[1]):
        os.write(terminal[0], b"\x1b[A\x1b[H\x1bOR\x1b[<64;1;1M ")
        assert followed.comes_to(RunState.PAUSING)
        os.write(terminal[0], b"\x1bORs")
        assert followed.comes_to(RunState.ENDING)
    assert followed.states == [RunState.RUNNING, RunState.PAUSING, RunState.ENDING]


def test_the_terminal_is_as_it_was_after_an_error_too(followed, terminal) -> None:
    before = termios.tcgetattr(terminal[1])
    with pytest.raises(RuntimeError), Keys(followed.control, terminal[1]):
        raise RuntimeError("in the midst")
    assert termios.tcgetattr(terminal[1]) == before


@pytest.mark.parametrize(
    ("number", "state"),
    [(signal.SIGINT, RunState.PAUSING), (signal.SIGTSTP, RunState.PAUSING)],
    ids=["Ctrl-C", "Ctrl-Z"],
)
def test_signals_pause(followed, number, state) -> None:
    before: Callable[..., object] = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with Keys(followed.control, None):
            os.kill(os.getpid(), number)
            assert followed.comes_to(state)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_without_a_terminal_a_pause_ends_by_the_signal_that_continues(followed) -> None:
    with Keys(followed.control, None):
        followed.control.pause()
        followed.control.tell(RunEvent.CHECKPOINT)
        followed._came[RunState.RUNNING].clear()
        os.kill(os.getpid(), signal.SIGCONT)
        assert followed.comes_to(RunState.RUNNING)


def test_who_asks_gets_the_answer_and_no_pause(followed) -> None:
    keys = Keys(followed.control, None)
    asked = threading.Thread(target=lambda: answers.append(keys.wait(ENTER)))
    answers: list[str] = []
    asked.start()
    while asked.is_alive():
        keys.pressed("x")  # on the way to Enter
        keys.pressed("\r")
        asked.join(0.01)
    assert answers == [ENTER]
    assert followed.control.state is RunState.RUNNING


def test_an_enter_too_many_answers_no_later_question() -> None:
    typed = [ENTER, ENTER]  # both in one read
    looks: list[int] = []

    def meanwhile() -> Exception | None:
        looks.append(1)
        while typed:
            keys.pressed(typed.pop())
        return DeviceLost("psd: nobody answers") if len(looks) == 3 else None

    control = RunControl(lambda: None, failure=meanwhile)
    control.tell(RunEvent.START)
    keys = Keys(control, None)
    assert keys.wait(ENTER) == ENTER
    with pytest.raises(DeviceLost, match="nobody answers"):
        keys.wait(ENTER)


def test_a_device_that_fails_ends_the_question() -> None:
    control = RunControl(lambda: None, failure=lambda: StoppedError("STOP was pressed on the live page"))
    control.tell(RunEvent.START)
    with pytest.raises(StoppedError, match="live page"):
        Keys(control, None).wait(ENTER)
    assert control.state is RunState.ABORTED


def test_an_abort_ends_the_question(followed) -> None:
    followed.control.abort()
    with pytest.raises(StoppedError, match="given up"):
        Keys(followed.control, None).wait(ENTER)


@pytest.mark.parametrize(("number", "why"), [(signal.SIGTERM, "SIGTERM"), (signal.SIGHUP, "the terminal was closed")])
def test_a_signal_that_ends_the_session_aborts_it(followed, number, why) -> None:
    with Keys(followed.control, None):
        os.kill(os.getpid(), number)
        assert followed.comes_to(RunState.ABORTING)
        with pytest.raises(StoppedError, match=f"^{why}: the session was aborted"):
            followed.control.checkpoint()


def test_a_signal_that_came_when_nothing_was_under_way_ends_the_program(followed) -> None:
    followed.control.finish()
    with pytest.raises(KeyboardInterrupt, match="SIGTERM"), Keys(followed.control, None) as keys:
        keys.signalled(signal.SIGTERM)


class JumpingClock:
    time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds


@pytest.mark.parametrize(("gap_s", "left"), [(0.1, "r"), (5.0, "")])
def test_what_was_typed_while_this_program_was_frozen_is_dropped(followed, terminal, gap_s, left) -> None:
    ours, theirs = terminal
    clock = JumpingClock()
    keys = Keys(followed.control, theirs, clock)
    tty.setcbreak(theirs)
    os.write(ours, b"r")
    assert select.select([theirs], [], [], PATIENCE_S)[0]
    clock.time_s += gap_s
    assert keys._was_frozen() is not bool(left)
    waits = bool(select.select([theirs], [], [], 0.0)[0])
    assert (os.read(theirs, 8).decode() if waits else "") == left
