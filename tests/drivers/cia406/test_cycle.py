"""When SYNCs are due, and to which of them an answer belongs."""

import math

import pytest

from drivers.cia406.cycle import ANSWER_LIMIT_S, HOLD_S, MOST_UNDER_WAY, SyncCycle

PERIOD_S = 0.005


@pytest.fixture
def cycle() -> SyncCycle:
    """Two nodes, from t = 10 s, numbers from 0."""
    return SyncCycle(2, PERIOD_S, 10.0, 0)


def answered(cycle: SyncCycle, now_s: float) -> int:
    """Send a SYNC and have both answer at once; its number."""
    assert cycle.sync_due(now_s)
    cycle.sent(now_s)
    assert cycle.answer(0, 1.0, now_s) == ()
    (row,) = cycle.answer(1, 2.0, now_s)
    assert row.position_rad == (1.0, 2.0)
    return row.sequence


def test_syncs_are_due_at_fixed_deadlines(cycle):
    for number in range(100):
        assert not cycle.sync_due(10.0 + number * PERIOD_S - 1e-4)
        assert answered(cycle, 10.0 + number * PERIOD_S + 1e-4) == number


def test_the_next_sync_goes_out_at_its_time_while_answers_are_on_their_way(cycle):
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    assert cycle.wakes_s == pytest.approx(10.005)
    assert cycle.sync_due(10.005)
    cycle.sent(10.005)
    assert cycle.answer(1, 2.0, 10.006) == ()
    assert cycle.answer(0, 1.1, 10.007) == ()
    first, second = cycle.answer(1, 2.1, 10.008)
    assert (first.sequence, first.sent_s, first.position_rad) == (0, 10.0, (1.0, 2.0))
    assert (second.sequence, second.sent_s, second.position_rad) == (1, 10.005, (1.1, 2.1))


def test_a_lost_answer_makes_no_wrong_row(cycle):
    """Node 1 loses its answer to the first SYNC; its later ones are one too early in the count."""
    for number in range(4):
        cycle.sent(10.0 + number * PERIOD_S)
        assert cycle.answer(0, 1.0 + number, 10.0 + number * PERIOD_S) == ()
        if number > 0:
            assert cycle.answer(1, 2.0 + number, 10.0 + number * PERIOD_S) == ()
    rows = cycle.give_up(10.0 + 3 * PERIOD_S + ANSWER_LIMIT_S)
    assert [row.position_rad[0] for row in rows] == [1.0, 2.0, 3.0, 4.0]
    assert all(math.isnan(row.position_rad[1]) for row in rows)


def test_a_bus_that_is_never_quiet_is_let_come_to_rest(cycle):
    """Both nodes answer one SYNC late; after HOLD_S none goes out until all is answered, then rows are certain."""
    rows, number, t_s = [], 0, 10.0
    while cycle.sync_due(t_s):
        cycle.sent(t_s)
        if number > 0:
            rows += cycle.answer(0, number - 1.0, t_s)
            rows += cycle.answer(1, number - 1.0, t_s)
        number, t_s = number + 1, t_s + PERIOD_S
    assert t_s == pytest.approx(10.0 + HOLD_S, abs=1.5 * PERIOD_S)
    assert rows == []
    assert cycle.wakes_s > t_s
    cycle.answer(0, number - 1.0, t_s)
    rows = cycle.answer(1, number - 1.0, t_s)
    assert [row.position_rad for row in rows] == [(float(n), float(n)) for n in range(number)]
    assert cycle.sync_due(t_s)


def test_no_more_than_some_syncs_are_on_the_way():
    cycle, sent = SyncCycle(1, 0.001, 10.0, 0), 0
    while cycle.sync_due(10.0001 + 0.001 * sent):
        cycle.sent(10.0001 + 0.001 * sent)
        sent += 1
    assert sent == MOST_UNDER_WAY
    assert cycle.give_up(10.0001 + ANSWER_LIMIT_S) == ()
    assert cycle.sync_due(10.0001 + ANSWER_LIMIT_S)


def test_a_deadline_left_out_is_a_step_of_the_sequence(cycle):
    assert answered(cycle, 10.0) == 0
    assert answered(cycle, 10.0 + 7.5 * PERIOD_S) == 7
    assert answered(cycle, 10.0 + 8 * PERIOD_S) == 8


def test_a_node_that_does_not_answer_is_nan(cycle):
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    assert cycle.give_up(10.0 + 0.9 * ANSWER_LIMIT_S) == ()
    (row,) = cycle.give_up(10.0 + ANSWER_LIMIT_S)
    assert row.position_rad[0] == 1.0
    assert math.isnan(row.position_rad[1])


def test_a_sync_that_nobody_answers_is_no_row(cycle):
    cycle.sent(10.0)
    assert cycle.give_up(10.0 + ANSWER_LIMIT_S) == ()
    assert cycle.sync_due(10.0 + ANSWER_LIMIT_S)


def test_an_answer_that_may_be_late_is_not_taken_for_a_new_one(cycle):
    """Node 1 misses a SYNC; whatever it says to the next may belong to either, and the one after is sure again."""
    cycle.sent(10.0)
    cycle.answer(0, 1.0, 10.001)
    cycle.give_up(10.0 + ANSWER_LIMIT_S)
    cycle.sent(10.2)
    cycle.answer(0, 1.0, 10.201)
    assert not cycle.sync_due(10.25)  # and one at a time until then
    (row,) = cycle.answer(1, 2.0, 10.252)
    assert math.isnan(row.position_rad[1])
    answered(cycle, 10.3)


def test_second_and_unasked_answers_are_late(cycle):
    assert not cycle.awaits(0)
    cycle.sent(10.0)
    assert cycle.awaits(0)
    cycle.answer(0, 1.0, 10.001)
    assert not cycle.awaits(0)
    assert cycle.late_answers == 2


def test_silence_is_counted_from_the_first_unanswered_sync_and_reported_once(cycle):
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


def test_a_schedule_that_goes_on_later_counts_the_deadlines_between(cycle):
    assert cycle.sequence_at(500.0) == 0  # nothing was sent yet: nothing is missing
    answered(cycle, 10.0)
    assert cycle.sequence_at(10.0) == 1
    assert cycle.sequence_at(10.0 + 1000.5 * PERIOD_S) == 1001
