"""Whole sessions in a terminal of their own, interrupted from outside; motion as the controller reports it."""

import os
import signal
from pathlib import Path

import pytest

from acquisition.recording import read
from benchmarks.stops import CRUISES_RAD_S, GO_CUE, MOVES_RAD_S, Staged, staged, travelling

from .conftest import RIG_FILE

TIME_SCALE = 2.0
QUIET_S = 4.0  # emulated, in which nothing may move; two seconds of this machine
BRAKES_S = 0.5  # emulated; the question may come before the arm stands
CLOSED = "the recording is closed"


def moves_for(s: Staged, seconds: float) -> bool:
    """Whether a joint moves in so much emulated time, once an arm that brakes now has come to rest."""
    begin_s = s.now_s() + BRAKES_S
    assert s.until(lambda: s.watch.newest()[0] > begin_s + seconds, ended=True)
    return bool((s.watch.since(begin_s)[1] > MOVES_RAD_S).any())


def interrupt_waits(pid: int) -> bool:
    """Whether a SIGINT was sent and not yet taken: proc(5), ShdPnd, the signals that wait for the whole process."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:  # it has ended
        return False
    waiting = next(line.split()[1] for line in status.splitlines() if line.startswith("ShdPnd"))
    return bool(int(waiting, 16) >> signal.SIGINT - 1 & 1)


def ten_ctrl_c(s: Staged) -> int:
    """As the terminal sends them, but each only when the one before was taken: the system keeps no two of a kind."""
    for _ in range(10):
        if s.process.poll() is None:
            os.killpg(s.process.pid, signal.SIGINT)
            s.until(lambda: not interrupt_waits(s.process.pid))
    s.until(lambda: s.process.poll() is not None, 30.0)
    return s.process.wait(30.0)


def test_a_killed_control_child_is_reported_and_a_person_decides() -> None:
    """And then ten Ctrl-C end what was gone on with."""
    with staged(RIG_FILE, time_scale=TIME_SCALE, travels=True) as s:
        assert travelling(s)
        os.kill(s.child(), signal.SIGKILL)
        assert s.until(lambda: "THE ARM WAS STOPPED" in s.log and CLOSED in s.screen)
        assert not moves_for(s, QUIET_S)
        assert s.process.poll() is None
        s.type("g\n")
        assert s.until(lambda: "does the fixture still stand" in s.screen)
        s.type("y\n")
        assert s.until(lambda: s.screen.count(GO_CUE) == 2)
        assert not moves_for(s, 1.0)
        s.type("go\n")
        assert s.until(lambda: s.watch.newest()[1] > CRUISES_RAD_S)
        assert ten_ctrl_c(s) == 3
        assert "Traceback" not in s.screen
        assert "pause: the arm brakes on its way and stands within" in s.log
        for name in ("recording.mcap", "recording-0002.mcap"):
            assert not read(s.folder / "out" / name).complete


@pytest.mark.endure
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_with_what_was_taken(number) -> None:
    with staged(RIG_FILE, time_scale=TIME_SCALE, travels=True) as s:
        assert travelling(s)
        s.signal(number)
        assert s.until(lambda: s.process.poll() is not None, 30.0)
        assert s.process.wait(30.0) == 3
        assert not moves_for(s, QUIET_S)
        assert "the session was aborted" in s.log
        assert not read(s.folder / "out" / "recording.mcap").complete


@pytest.mark.endure
@pytest.mark.parametrize("typed", ["r", "\n", "g\n"])
def test_a_frozen_session_counts_nothing_that_was_typed_meanwhile(typed) -> None:
    with staged(RIG_FILE, time_scale=TIME_SCALE, travels=True) as s:
        assert travelling(s)
        s.signal(signal.SIGSTOP)
        assert s.until(lambda: s.watch.newest()[1] < MOVES_RAD_S)
        s.type(typed)
        assert not moves_for(s, 5.0 * TIME_SCALE)
        s.signal(signal.SIGCONT)
        assert s.until(lambda: CLOSED in s.screen)
        assert not moves_for(s, QUIET_S)
        assert s.process.poll() is None
