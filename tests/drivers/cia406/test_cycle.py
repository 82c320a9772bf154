"""When SYNCs are due, and to which of them an answer belongs."""

import math

import pytest

from drivers.cia406.cycle import ANSWER_LIMIT_S, SyncCycle

PERIOD_S = 0.005


@pytest.fixture
def cycle() -> SyncCycle:
    """Two nodes, from t = 10 s, numbers from 0."""
    return SyncCycle(2, PERIOD_S, 10.0, 0)


def answered(cycle: SyncCycle, now_s: float) -> int:
    """Send a SYNC and have both answer at once; its number."""
    assert cycle.sync_due(now_s)
    cycle.sent(now_s)
    assert cycle.answer(0, 1.0, now_s) is None
    row = cycle.answer(1, 2.0, now_s)
    assert row is not None
    assert row.position_rad == (1.0, 2.0)
    return row.sequence


def test_syncs_are_due_at_fixed_deadlines(cycle):
    for number in range(100):
        assert not cycle.sync_due(10.0 + number * PERIOD_S - 1e-4)
        assert answered(cycle, 10.0 + number * PERIOD_S + 1e-4) == number


def test_the_next_sync_waits_for_all_answers(cycle):
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    assert not cycle.sync_due(10.007)
    cycle.answer(1, 2.0, 10.007)
    assert cycle.sync_due(10.007)


def test_a_deadline_left_out_is_a_step_of_the_sequence(cycle):
    assert answered(cycle, 10.0) == 0
    assert answered(cycle, 10.0 + 7.5 * PERIOD_S) == 7
    assert answered(cycle, 10.0 + 8 * PERIOD_S) == 8


def test_a_node_that_does_not_answer_is_nan(cycle):
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    assert cycle.give_up(10.0 + 0.9 * ANSWER_LIMIT_S) is None
    row = cycle.give_up(10.0 + ANSWER_LIMIT_S)
    assert row is not None
    assert row.position_rad[0] == 1.0
    assert math.isnan(row.position_rad[1])


def test_a_sync_that_nobody_answers_is_no_row(cycle):
    cycle.sent(10.0)
    assert cycle.give_up(10.0 + ANSWER_LIMIT_S) is None
    assert cycle.sync_due(10.0 + ANSWER_LIMIT_S)


def test_an_answer_that_may_be_late_is_not_taken_for_a_new_one(cycle):
    """Node 1 misses a SYNC; whatever it says to the next may belong to either, and the one after is sure again."""
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    cycle.give_up(10.0 + ANSWER_LIMIT_S)
    cycle.sent(10.2)
    cycle.answer(0, 1.0, 10.201)
    row = cycle.answer(1, 2.0, 10.201)
    assert row is not None
    assert math.isnan(row.position_rad[1])
    answered(cycle, 10.3)


def test_second_and_unasked_answers_are_late(cycle):
    assert not cycle.awaits(0)
    cycle.sent(10.0)
    assert cycle.awaits(0)
    cycle.answer(0, 1.0, 10.001)
    assert not cycle.awaits(0)
    assert cycle.late_answers == 2


def test_silence_is_counted_from_the_first_unanswered_sync_and_told_once(cycle):
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    cycle.give_up(10.0 + ANSWER_LIMIT_S)
    assert cycle.silent(0.5, 10.4) == []
    assert cycle.silent(0.5, 10.5) == [1]
    assert cycle.silent(0.5, 10.6) == []
    assert cycle.silent(0.5, 11.0) == [1]
    cycle.sent(11.0)
    cycle.answer(1, 2.0, 11.001)
    assert cycle.silent(0.5, 20.0) == []
