"""What a model states of a later recording: held near where neither it nor the data know anything, and only there."""

import numpy as np

from calibrate.diagnose.state.assumed import Assumed

AT, OTHERS, UNIT = np.array([0, 1]), np.array([2]), np.full(2, 1e-3)
TRADED = np.array([1.0, -1.0]) / np.sqrt(2.0)
TOGETHER = np.array([1.0, 1.0]) / np.sqrt(2.0)
LOOSE, SHARP = 0.1, 3e-6  # sigma of either combination
COVARIANCE = LOOSE**2 * np.outer(TRADED, TRADED) + SHARP**2 * np.outer(TOGETHER, TOGETHER)


def assumed():
    return Assumed.of(AT, np.zeros(2), COVARIANCE, np.ones(2))


def sigma(of, direction):
    return np.sqrt(direction @ np.linalg.inv(of.root.T @ of.root) @ direction)


def test_what_nobody_knows_is_held_to_a_unit_and_what_is_known_stays():
    near = assumed().held_near(np.array([[1e5, 1e5, 1.0], [2e5, 2e5, -1.0]]), OTHERS, UNIT)
    assert np.isclose(sigma(near, TRADED), 1e-3, rtol=1e-3)
    assert np.isclose(sigma(near, TOGETHER), SHARP, rtol=1e-3)
    assert near.jacobian(3).shape == (3, 3)
    assert len(near.residual(np.zeros(3))) == 3


def test_what_the_data_show_is_left_open():
    seen = assumed().held_near(np.array([[1e5, -1e5, 1.0], [2e5, 2e5, -1.0], [0.0, 1e5, 0.0]]), OTHERS, UNIT)
    assert seen.root.shape == (2, 2)
    assert np.isclose(sigma(seen, TRADED), LOOSE, rtol=1e-3)


def test_what_only_a_free_value_could_imitate_is_not_seen():
    """The one row that parts the two is what the third value, free, is found from."""
    near = assumed().held_near(np.array([[1e5, -1e5, 1.0]]), OTHERS, UNIT)
    assert near.root.shape == (3, 2)


def test_a_model_that_knows_everything_stays_as_it_is():
    known = Assumed.of(AT, np.zeros(2), SHARP**2 * np.eye(2), np.ones(2))
    assert known.held_near(np.zeros((1, 3)), OTHERS, UNIT) is known
