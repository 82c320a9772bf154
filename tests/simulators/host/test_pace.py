"""Emulated time follows wall time at its rate, catches up a little, and never jumps."""

import pytest

from simulators.host.loop import STALL_S, Pace


def ticks_taken(pace: Pace, now_s: float) -> int:
    count = 0
    while pace.take(now_s):
        count += 1
    return count


def test_ticks_fall_due_at_the_rate():
    pace = Pace(0.0005, 10.0)
    assert ticks_taken(pace, 9.9999) == 0
    assert ticks_taken(pace, 10.0) == 1
    assert ticks_taken(pace, 10.00501) == 10
    assert pace.next_s == pytest.approx(10.0055)


def test_short_lateness_is_caught_up():
    pace = Pace(0.002, 0.0)
    assert ticks_taken(pace, STALL_S - 0.001) == 25  # t = 0, 2, ... 48 ms
    assert (pace.stalls, pace.lost_s) == (0, 0.0)


def test_a_long_stall_is_counted_and_not_caught_up():
    pace = Pace(0.002, 0.0)
    assert ticks_taken(pace, 0.0) == 1
    assert ticks_taken(pace, 5.0) == 1
    assert pace.stalls == 1
    assert pace.lost_s == pytest.approx(5.0 - 0.002)
    assert pace.next_s == pytest.approx(5.002)


def test_a_machine_too_slow_for_the_rate_runs_as_fast_as_it_can_and_says_so():
    pace = Pace(0.001, 0.0)
    now_s = 0.0
    for _ in range(1000):  # each tick costs three times what it may
        assert pace.take(now_s)
        now_s += 0.003
    assert pace.stalls > 10
    assert pace.lost_s == pytest.approx(2.0, rel=0.05)
