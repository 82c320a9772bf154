"""Rank before numbers: what cannot be told is named, in words."""

import numpy as np

from calibrate.identifiability import analyse, in_words
from calibrate.parameters import Parameter


def names(*which, prior=np.inf):
    return tuple(Parameter(n, "rad", 1.0, prior=prior) for n in which)


def test_independent_columns_are_all_determined_with_their_sigma():
    seen = analyse(np.diag([10.0, 5.0]), names("joint1.zero", "joint2.zero"))
    assert (seen.rank, seen.n_free, seen.combinations) == (2, 2, ())
    np.testing.assert_allclose(seen.sigma, [0.1, 0.2])
    assert seen.condition == 2.0


def test_a_sum_that_alone_is_seen_names_both_and_holds_the_joint_zero():
    J = np.array([[100.0, 100.0, 0.0], [0.0, 0.0, 50.0], [100.0, 100.0, 50.0]])
    seen = analyse(J, names("placement1.yaw", "joint1.zero", "joint2.zero"))
    (combination,) = seen.combinations
    assert combination.words == "joint1.zero + placement yaw"
    assert combination.representative == "joint1.zero"
    assert combination.structural
    assert np.isinf(seen.sigma).tolist() == [True, True, False]
    assert "only in combination" in str(seen.reason("placement1.yaw"))
    assert seen.reason("joint2.zero") is None


def test_two_separate_losses_are_told_apart():
    J = np.kron(np.eye(2), np.ones((2, 2))) * 100.0
    seen = analyse(J, names("joint1.zero", "placement1.yaw", "laser.tilt_u", "joint6.zero"))
    assert {c.words for c in seen.combinations} == {
        "joint1.zero + placement yaw",
        "joint6.zero + laser mount tilt_u",
    }


def test_a_prior_makes_a_combination_known_to_the_size_of_the_prior():
    J = np.full((3, 2), 1e4)
    parameters = (*names("joint4.zero"), Parameter("link4.tilt", "rad", 5e-4, prior=5e-4))
    seen = analyse(J, parameters)
    assert seen.rank == 2
    np.testing.assert_allclose(seen.sigma, [5e-4, 5e-4], rtol=0.01)


def test_weak_data_are_not_called_geometry():
    J = np.diag([1e4, 0.1])
    (combination,) = analyse(J, names("joint2.zero", "joint3.zero")).combinations
    assert not combination.structural
    assert combination.representative == "joint3.zero"


def test_fewer_rows_than_parameters_lose_the_difference():
    seen = analyse(np.array([[3.0, 4.0, 5.0]]) * 100, names("joint1.zero", "joint2.zero", "joint3.zero"))
    assert (seen.rank, len(seen.combinations)) == (1, 2)
    assert np.isinf(seen.sigma).all()


def test_something_without_any_effect_is_said_so():
    seen = analyse(np.array([[1e3, 0.0]]), names("joint2.zero", "joint1.zero"))
    assert seen.reason("joint1.zero") == "the measurement does not depend on it"


def test_what_all_placements_share_is_said_once():
    listed = ["joint1.zero", "placement1.x", "placement1.yaw", "placement2.x", "laser.tilt_u", "link6.offset"]
    assert in_words(listed) == "joint1.zero + placement x, yaw + laser mount tilt_u + link6.offset"
