"""What Ctrl-C and words at the keyboard tell the gate."""

import io
import signal

import pytest

from acquisition.errors import InterruptedMotionError
from acquisition.motion.states import MotionEvent, MotionState, after
from calibeam.asking import Asking
from calibeam.motion.by_hand import ARRIVED_RAD, WORDS, MotionKeys, ending_words, keys_of
from calibeam.outcome import INTERRUPTS

PATIENCE_S = 30.0


class RecordingGate:
    """A gate that keeps what it was told, and follows the table of states; it is paused twice within ten seconds."""

    def __init__(self, state: MotionState) -> None:
        self.state, self.requests = state, []
        self.brake_s = 0.4

    def rests_in_s(self) -> float:
        return 0.7

    def _tell(self, event: MotionEvent) -> None:
        self.requests.append(event.value)
        self.state = after(self.state, event)

    def pause(self) -> None:
        self._tell(MotionEvent.HOLD if self.state is MotionState.PAUSING else MotionEvent.PAUSE)

    def resume(self) -> None:
        self._tell(MotionEvent.RESUME)

    def stop(self) -> None:
        self._tell(MotionEvent.STOP)

    def abort(self) -> None:
        self._tell(MotionEvent.ABORT)

    def halt(self) -> None:
        self._tell(MotionEvent.HALT)


def test_ctrl_c_pauses_then_holds_then_gives_up() -> None:
    gate, out = RecordingGate(MotionState.MOVING), io.StringIO()
    keys = MotionKeys(gate, None, out)  # type: ignore[arg-type]
    for state in (MotionState.PAUSING, MotionState.HELD, MotionState.ENDING):
        keys.interrupted()
        assert gate.state is state
    assert gate.requests == ["pause", "hold", "abort"]
    assert "resting at the next place within 0.7 s; Ctrl-C again brakes now" in out.getvalue()
    assert "at rest within 0.4 s; Ctrl-C again gives the motion up" in out.getvalue()


@pytest.mark.parametrize("state", [MotionState.IDLE, MotionState.DONE])
@pytest.mark.parametrize("key", ["interrupted", "ended"])
def test_a_key_while_nothing_moves_ends_the_next_motion_before_it_begins(state: MotionState, key: str) -> None:
    gate, watched = RecordingGate(state), list[str]()
    keys = MotionKeys(gate, None, io.StringIO())  # type: ignore[arg-type]
    watch = keys.alongside(lambda: watched.append("looked"))
    watch()
    getattr(keys, key)()
    gate.state = MotionState.MOVING  # the next motion of a program
    with pytest.raises(InterruptedMotionError, match="while nothing moved"):
        watch()
    assert watched == ["looked", "looked"]


@pytest.mark.parametrize("key", ["interrupted", "ended"])
def test_a_key_in_a_motion_is_left_to_the_gate_that_brakes_it(key: str) -> None:
    keys = MotionKeys(RecordingGate(MotionState.MOVING), None, io.StringIO())  # type: ignore[arg-type]
    getattr(keys, key)()
    keys.alongside(lambda: None)()


@pytest.mark.parametrize(("word", "received"), [("r\n", "resume"), ("Stop", "stop"), ("a", "abort"), ("h", "halt")])
def test_words(word: str, received: str) -> None:
    gate = RecordingGate(MotionState.HELD)
    MotionKeys(gate, None, io.StringIO()).word(word)  # type: ignore[arg-type]
    assert gate.requests == [received]


@pytest.mark.parametrize("word", ["what", "rest", "", "\x1b[A"])
def test_another_word_does_nothing(word: str) -> None:
    gate = RecordingGate(MotionState.HELD)
    MotionKeys(gate, None, io.StringIO()).word(word)  # type: ignore[arg-type]
    assert gate.requests == []


def test_a_word_typed_ahead_does_not_resume(typist) -> None:
    gate = RecordingGate(MotionState.MOVING)
    typist.ahead("r\n")
    typist.answers("> ", "what\n", "s\n")
    keys = MotionKeys(gate, Asking(typist.terminal), io.StringIO())  # type: ignore[arg-type]
    keys.interrupted()
    assert keys._thread is not None
    keys._thread.join(PATIENCE_S)
    assert gate.requests == ["pause", "stop"]
    assert typist.screen.count(WORDS) == 2


def test_a_closed_terminal_gives_up() -> None:
    gate = RecordingGate(MotionState.MOVING)
    MotionKeys(gate, None, io.StringIO()).ended()  # type: ignore[arg-type]
    assert gate.state is MotionState.ENDING


@pytest.mark.parametrize(
    ("number", "received"), [(signal.SIGINT, "pause"), (signal.SIGTERM, "abort"), (signal.SIGHUP, "abort")]
)
def test_signals_reach_the_gate_while_it_is_followed_and_no_longer(monkeypatch, number, received) -> None:
    monkeypatch.setattr(INTERRUPTS, "leave_terminal", lambda: None)
    before, gate = signal.getsignal(number), RecordingGate(MotionState.MOVING)
    with keys_of(gate):  # type: ignore[arg-type]
        signal.raise_signal(number)
    assert gate.requests == [received]
    assert signal.getsignal(number) is before


def test_the_keyboard_is_left_when_the_held_motion_ends(typist) -> None:
    gate = RecordingGate(MotionState.MOVING)
    keys = MotionKeys(gate, Asking(typist.terminal), io.StringIO())  # type: ignore[arg-type]
    keys.interrupted()
    assert typist.shows("> ")
    keys.ended()
    assert keys._thread is not None
    keys._thread.join(PATIENCE_S)
    assert not keys._thread.is_alive()


def test_a_motion_that_was_stopped_has_not_arrived() -> None:
    assert ending_words(MotionState.DONE, 0.1 * ARRIVED_RAD) == "arrived"
    assert ending_words(MotionState.DONE, 10.0 * ARRIVED_RAD) == "stopped on request before the end of the plan"
    assert ending_words(MotionState.ABORTED, 10.0 * ARRIVED_RAD) == MotionState.ABORTED.value
