"""STOP in every state: no arm, an arm, one that refuses, one that hangs."""

import threading

import pytest

from calibeam.live.stopping import Stop, Viewers, overdue, watched_pages
from drivers.errors import DeviceLost


@pytest.fixture
def stop(clock) -> Stop:
    return Stop(clock)


def test_without_an_arm_it_says_what_to_do(stop) -> None:
    stopped = stop.press("a page")
    assert not stopped.delivered
    assert "no arm" in stopped.says
    assert "emergency stop" in stopped.says


def test_an_arm_is_stopped_as_often_as_it_is_pressed(stop) -> None:
    pressed: list[int] = []
    stop.by(lambda: pressed.append(1))
    assert stop.press("a page").delivered
    assert stop.press("a page").delivered
    assert len(pressed) == 2
    assert stop.last is not None
    assert stop.last.delivered


def test_an_arm_that_does_not_take_it_is_reported_loudly(stop) -> None:
    def refuse() -> None:
        raise DeviceLost("robot: no way to the controller")

    stop.by(refuse)
    stopped = stop.press("a page")
    assert not stopped.delivered
    assert stopped.says == "NOT DELIVERED, press the red emergency stop now: robot: no way to the controller"


def test_a_press_that_hangs_keeps_no_other_from_trying(stop) -> None:
    hanging, release = threading.Event(), threading.Event()

    def hang() -> None:
        hanging.set()
        release.wait(10.0)

    stop.by(hang)
    first = threading.Thread(target=stop.press, args=("one",))
    first.start()
    assert hanging.wait(5.0)
    stop.by(lambda: None)
    assert stop.press("another").delivered
    release.set()
    first.join()
    assert stop.last is not None
    assert stop.last.who in ("one", "another")


def test_pages_that_were_never_there_are_not_missed(clock) -> None:
    viewers = Viewers(clock)
    assert not overdue(viewers, 5.0, 1e6)
    viewers.newest_s = 100.0
    assert not overdue(viewers, 5.0, 105.0)
    assert overdue(viewers, 5.0, 105.1)


def test_where_the_rig_says_so_a_page_that_is_gone_stops_once(stop, clock) -> None:
    stopped = threading.Event()
    viewers = Viewers(clock)
    viewers.newest_s = clock.now_s()
    stop.by(stopped.set)
    with watched_pages(stop, viewers, 5.0, clock):
        clock.time_s += 5.1
        assert stopped.wait(5.0)
    assert stop.last is not None
    assert stop.last.who == "no page has answered for 5 s"


def test_a_stop_that_was_not_delivered_is_pressed_again_until_it_is(stop, clock, monkeypatch) -> None:
    monkeypatch.setattr("calibeam.live.stopping.AGAIN_S", 0.0)
    viewers, presses, third = Viewers(clock), [], threading.Event()
    viewers.newest_s = clock.now_s()

    def stopping() -> None:
        presses.append(1)
        if len(presses) < 3:
            raise DeviceLost("robot: no way to the controller")
        third.set()

    stop.by(stopping)
    with watched_pages(stop, viewers, 5.0, clock):
        clock.time_s += 5.1
        assert third.wait(5.0)
    assert len(presses) == 3
    assert stop.last.delivered


def test_else_pages_come_and_go(stop, clock) -> None:
    viewers = Viewers(clock)
    viewers.newest_s = clock.now_s()
    before = threading.active_count()
    with watched_pages(stop, viewers, None, clock):
        assert threading.active_count() == before
