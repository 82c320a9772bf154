"""The box's 32-bit count as one that only rises."""

from drivers.psd_daq.codec import WRAP, RepeatFilter, SequenceCount


def test_a_wrap_goes_on_counting():
    count = SequenceCount()
    assert count.unwrap(WRAP - 10, 10) == WRAP - 10
    assert count.unwrap(0, 10) == WRAP
    assert count.unwrap(10, 10) == WRAP + 10


def test_lost_frames_stay_a_step():
    count = SequenceCount()
    count.unwrap(0, 10)
    assert count.unwrap(30, 10) == 30


def test_a_loss_across_the_wrap_stays_a_step():
    count = SequenceCount()
    count.unwrap(WRAP - 10, 10)
    assert count.unwrap(20, 10) == WRAP + 20


def test_a_new_stream_is_behind_a_gap():
    count = SequenceCount()
    count.restart()
    assert count.unwrap(0, 10) == 0
    count.restart()
    assert count.unwrap(0, 10) == 11


def test_a_frame_that_comes_twice_does_not_count_as_a_wrap():
    count = SequenceCount()
    count.unwrap(0, 10)
    count.unwrap(10, 10)
    assert count.unwrap(10, 10) == 10


def test_a_frame_that_came_before_is_not_new() -> None:
    frames = RepeatFilter()
    assert frames.is_new(0, 10)
    assert frames.is_new(10, 10)
    assert not frames.is_new(10, 10)
    assert not frames.is_new(0, 10)
    assert frames.is_new(50, 10)  # a gap is no repeat
    assert frames.is_new(2**31 - 1, 10)


def test_a_wrap_is_no_repeat() -> None:
    frames = RepeatFilter()
    assert frames.is_new(WRAP - 10, 10)
    assert frames.is_new(0, 10)
    assert not frames.is_new(WRAP - 10, 10)
