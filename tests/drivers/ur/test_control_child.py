"""The child's order of stops and calls, with a control object that only takes notes."""

import socket

import pytest

from drivers.ur.control_child import ControlChild
from drivers.ur.control_link import (
    BEAT_S,
    LEASE_S,
    Alive,
    Beat,
    Call,
    Ended,
    Freedrive,
    Link,
    MoveJoints,
    Outcome,
    ServoJoints,
    Stop,
)

MOVE = MoveJoints([0.0] * 6, 1.0, 1.0)


class Notes:
    def __init__(self) -> None:
        self.done: list[str] = []
        self.looks_left = 0  # at a motion that is under way
        self.looked = lambda: None

    def moveJ(self, q, speed, acceleration, asynchronous) -> bool:
        self.done.append("move")
        return True

    def servoJ(self, *numbers) -> bool:
        self.done.append("servo")
        return True

    def stopJ(self, a) -> None:
        self.done.append("stop")

    def servoStop(self, a) -> bool:
        self.done.append("servo stop")
        return True

    def freedriveMode(self) -> bool:
        self.done.append("freedrive")
        return True

    def endFreedriveMode(self) -> bool:
        self.done.append("freedrive ends")
        return True

    def getAsyncOperationProgress(self) -> int:
        self.looked()
        self.looks_left -= 1
        return 0 if self.looks_left >= 0 else -1

    def isConnected(self) -> bool:
        return True

    def isProgramRunning(self) -> bool:
        return True

    def kickWatchdog(self) -> bool:
        return True


class Child:
    def __init__(self) -> None:
        self.notes, self.silent, self.time_s = Notes(), False, 0.0
        near_calls, far_calls = socket.socketpair()
        near_stops, far_stops = socket.socketpair()
        self.calls, self.stops = Link(near_calls), Link(near_stops)
        self._ends = (Link(far_calls), Link(far_stops))
        self.child = ControlChild(self.notes, *self._ends, 1.0, lambda: self.time_s, lambda: self.silent)

    def turn(self) -> None:
        """One turn of the child's loop: a stop goes before a call."""
        self.child._expire()
        self.child._take_stop(0.0)
        request = self._ends[0].next_request(0.0)
        if request is not None:
            self._ends[0].send(self.child._obey(request))

    def turn_of_loop(self) -> None:
        """Nothing to be read."""
        self.child._expire()
        self.child._take_stop(0.0)

    def close(self) -> None:
        for link in (self.calls, self.stops, *self._ends):
            link.close()


@pytest.fixture
def child():
    child = Child()
    yield child
    child.close()


def test_a_call_that_was_sent_before_a_stop_does_not_begin_after_it(child) -> None:
    child.calls.send(Call(1, MOVE))
    child.stops.send(Stop(5.0, up_to=1))
    child.turn()
    assert child.notes.done == ["stop"]
    assert child.calls.next_answer(1.0) == Ended(Outcome.STOPPED)


def test_a_call_that_was_sent_after_the_stop_runs(child) -> None:
    child.stops.send(Stop(5.0, up_to=1))
    child.calls.send(Call(2, MOVE))
    child.turn()
    assert child.notes.done == ["stop", "move"]
    assert child.calls.next_answer(1.0) == Ended(Outcome.DONE)


def test_a_silent_controller_is_reported_before_braking_which_may_wait_for_it(child) -> None:
    child.silent = True
    child.stops.send(Stop(5.0))
    child.turn()
    assert [child.stops.next_answer(1.0) for _ in range(2)] == [Alive(), Ended(Outcome.SILENT)]
    assert child.notes.done == ["stop"]


def test_no_motion_begins_at_a_silent_controller(child) -> None:
    child.silent = True
    child.calls.send(Call(1, ServoJoints([0.0] * 6, 0.002, 0.1, 300.0)))
    child.turn()
    assert child.calls.next_answer(1.0) == Ended(Outcome.SILENT)
    assert child.notes.done == []


def test_beats_keep_a_motion_going(child) -> None:
    def looked() -> None:
        child.time_s += BEAT_S
        child.stops.send(Beat())

    child.notes.looked, child.notes.looks_left = looked, 50
    child.calls.send(Call(1, MOVE))
    child.turn()
    assert child.notes.done == ["move"]
    assert _ended(child) == Ended(Outcome.DONE)


def test_a_motion_is_braked_when_the_parent_beats_no_more(child) -> None:
    def looked() -> None:
        child.time_s += 0.5 * LEASE_S

    child.notes.looked, child.notes.looks_left = looked, 50
    child.calls.send(Call(1, MOVE))
    child.turn()
    assert child.notes.done == ["move", "stop"]
    assert child.time_s < 2.0 * LEASE_S
    assert _ended(child) == Ended(Outcome.EXPIRED)


@pytest.mark.parametrize("request_", [MOVE, ServoJoints([0.0] * 6, 0.002, 0.1, 300.0)])
def test_a_call_that_waited_in_the_line_of_a_frozen_child_is_not_begun(child, request_) -> None:
    """Fresh beats behind it change nothing: they are of the time after which nobody reckoned with this child."""
    child.stops.send(Beat())
    child.calls.send(Call(1, request_))
    child.time_s += 5.0
    child.stops.send(Beat())
    for number in (2, 3):
        child.turn()
        assert _ended(child) == Ended(Outcome.EXPIRED)
        child.calls.send(Call(number, request_))
        child.stops.send(Beat())
    assert child.notes.done == ["stop"]


def test_a_call_after_a_freeze_of_the_parent_is_not_begun(child) -> None:
    for _ in range(50):
        child.time_s += BEAT_S
        child.turn_of_loop()
    child.stops.send(Beat())
    child.calls.send(Call(1, MOVE))
    child.turn()
    assert _ended(child) == Ended(Outcome.EXPIRED)
    assert child.notes.done == ["stop"]


def test_the_end_of_a_motion_is_answered_at_the_next_look_a_millisecond_later(child, monkeypatch) -> None:
    """So a small move costs little more than its motion: nothing else is waited for."""
    waits_s: list[float] = []
    take = child.child._take_stop
    monkeypatch.setattr(child.child, "_take_stop", lambda timeout_s: waits_s.append(timeout_s) or take(timeout_s))
    looks: list[int] = []
    child.notes.looked, child.notes.looks_left = lambda: looks.append(1), 5
    child.calls.send(Call(1, MOVE))
    child.turn()
    assert child.calls.next_answer(0.0) == Ended(Outcome.DONE)
    assert len(looks) == 6
    assert waits_s == [0.0] + 5 * [0.001]


def _ended(child) -> object:
    answer = child.calls.next_answer(1.0)
    while isinstance(answer, Alive):
        answer = child.calls.next_answer(1.0)
    return answer


def test_a_stop_ends_freedrive_once(child) -> None:
    child.calls.send(Call(1, Freedrive(True)))
    child.turn()
    assert child.calls.next_answer(1.0) == Ended(Outcome.DONE)
    for number in (1, 1):
        child.stops.send(Stop(5.0, up_to=number))
        child.turn()
    assert child.notes.done == ["freedrive", "freedrive ends", "stop", "stop"]


def test_a_freedrive_that_does_not_end_is_tried_again_and_the_arm_brakes_all_the_same(child) -> None:
    child.calls.send(Call(1, Freedrive(True)))
    child.turn()

    def failing() -> bool:
        child.notes.done.append("does not end")
        raise RuntimeError("RTDE control script is not running")

    child.notes.endFreedriveMode = failing
    child.calls.send(Call(2, Freedrive(False)))
    child.turn()
    child.stops.send(Stop(2.0, 2))
    child.turn()
    assert child.notes.done == ["freedrive", "does not end", "does not end", "stop"]


def test_freedrive_ends_where_the_parent_beats_no_more(child) -> None:
    child.calls.send(Call(1, Freedrive(True)))
    child.turn()
    child.time_s += 1.5 * LEASE_S
    child.turn_of_loop()
    assert child.notes.done == ["freedrive", "freedrive ends", "stop"]
