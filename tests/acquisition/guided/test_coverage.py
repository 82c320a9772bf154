"""Which posture next: the one that fills what the joints have not shown yet."""

import numpy as np

from acquisition.guided.reading import Coverage

LOW, HIGH = np.array([-np.pi, -1.0]), np.array([np.pi, 1.0])


def test_steps_are_marked_as_they_are_visited():
    coverage = Coverage(LOW, HIGH)
    assert coverage.marks(0) == "·" * 12
    coverage.add(np.array([-3.1, 0.9]))
    coverage.add(np.array([-3.1, 0.9]))
    coverage.add(np.array([0.1, 0.9]))
    assert coverage.marks(0) == "█·····▪·····"
    assert coverage.marks(1) == "···█"
    assert coverage.shares == (2 / 12, 1 / 4)


def test_the_posture_in_empty_steps_is_chosen():
    coverage = Coverage(LOW, HIGH)
    coverage.add(np.array([0.1, 0.1]))
    near, far = np.array([0.15, 0.12]), np.array([2.0, -0.8])
    assert coverage.best(np.array([near, far]), []) is not None
    np.testing.assert_array_equal(coverage.best(np.array([near, far]), []), far)


def test_of_equal_postures_the_one_far_from_those_in_this_place_is_chosen():
    coverage = Coverage(LOW, HIGH)
    one, other = np.array([1.0, 0.1]), np.array([-1.0, -0.1])
    np.testing.assert_array_equal(coverage.best(np.array([one, other]), [one + 0.01]), other)


def test_an_angle_beyond_the_range_counts_at_its_end():
    coverage = Coverage(LOW, HIGH)
    coverage.add(np.array([4.0, -2.0]))
    assert coverage.marks(0)[-1] == "▪"
    assert coverage.marks(1)[0] == "▪"
