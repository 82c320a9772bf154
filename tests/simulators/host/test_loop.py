"""The order of a tick, and time that follows the clock that is passed in."""

import pytest

from simulators.wire import TICK_S, SerialPort


def test_a_tick_runs_in_the_order_of_the_seam(stage):
    on = stage()
    on.turns(2)
    assert on.diary.calls == [
        ("before", 0.0),
        ("advance", TICK_S),
        ("after", 0.0),
        ("before", TICK_S),
        ("advance", 2 * TICK_S),
        ("after", TICK_S),
    ]


def test_no_tick_before_its_time(stage):
    on = stage()
    on.turns(1)
    on.now_s = 0.0019
    on.host.turn(0.0)
    assert on.host.ticks == 1


def test_a_stall_of_the_machine_makes_emulated_time_lag_and_not_jump(stage):
    on = stage()
    on.turns(10)
    on.now_s += 3.0
    for _ in range(5):
        on.host.turn(0.0)
    assert on.host.ticks == 11
    assert on.host.pace.stalls == 1


def test_a_late_host_catches_up_four_ticks_a_turn(stage):
    on = stage()
    on.turns(1)
    on.now_s += 6.5 * TICK_S
    ticks = []
    for _ in range(3):
        on.host.turn(0.0)
        ticks.append(on.host.ticks)
    assert ticks == [5, 7, 7]
    assert on.host.pace.stalls == 0


def test_ticks_that_follow_faster_than_half_a_millisecond_share_a_turn(stage):
    on = stage(time_scale=8.0)
    ticks = []
    for due in (0.9, 1.1, 2.9, 3.1):  # in ticks
        on.now_s = due * TICK_S / 8.0
        on.host.turn(0.0)
        ticks.append(on.host.ticks)
    assert ticks == [0, 2, 2, 4]
    assert [call for call, _ in on.diary.calls] == ["before", "advance", "after"] * 4


def test_world_that_ran_before_goes_on_from_its_time(stage):
    on = stage(start_s=5 * TICK_S)
    on.turns()
    assert on.diary.calls[:2] == [("before", 5 * TICK_S), ("advance", 6 * TICK_S)]


def test_run_ends_when_it_is_asked(stage):
    on = stage()
    on.host.run(lambda: on.host.ticks >= 1)
    assert on.host.ticks == 1


def test_close_is_safe_twice(stage, echo):
    on = stage(SerialPort("psd", echo()))
    on.host.close()
    on.host.close()


def test_two_ports_of_one_name_are_a_mistake(stage, echo):
    with pytest.raises(ValueError, match="not unique"):
        stage(SerialPort("psd", echo()), SerialPort("psd", echo()))
