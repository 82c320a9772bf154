"""Rank before numbers: what cannot be determined is named, in words."""

from dataclasses import dataclass

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.fit.identify.point_constraint import BOUND_RAD, Constraint, PointConstraint
from calibrate.fit.rank.identifiability import analyse, in_words, plainly
from calibrate.fit.rank.observability import Redundant, analyse_along, observability, reduced
from calibrate.fit.solvers import Status, solve
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.dual_psd_rig import laser_of
from calibrate.model.parameters import Parameter


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


def test_two_separate_losses_are_distinguished():
    J = np.kron(np.eye(2), np.ones((2, 2))) * 100.0
    seen = analyse(J, names("joint1.zero", "placement1.yaw", "laser.tilt_u", "joint6.zero"))
    assert {c.words for c in seen.combinations} == {
        "joint1.zero + placement yaw",
        "joint6.zero + laser mount tilt_u",
    }


def test_who_represents_a_combination_does_not_depend_on_how_the_rows_are_turned():
    """Three offsets seen in their sum alone, and a zero with a yaw: equal members, and an unseen space of three."""
    rng = np.random.default_rng(4)
    J = np.concatenate([rng.normal(0, 100, (8, 1)) * [1, 1, 1, 0, 0, 0], rng.normal(0, 100, (8, 3)) @ np.eye(3, 6, 3)])
    J[:, 4] = J[:, 3]
    parameters = names("link2.offset", "link3.offset", "link4.offset", "placement1.yaw", "joint1.zero", "joint2.zero")
    found = set()
    for _ in range(20):
        turned = np.linalg.qr(rng.normal(size=(16, 16)))[0] @ J
        found.add(tuple((c.representative, c.members) for c in analyse(turned, parameters).combinations))
    assert len(found) == 1
    assert {who for who, _ in found.pop()} == {"joint1.zero", "link2.offset", "link3.offset"}


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


@pytest.mark.parametrize(
    ("listed", "said"),
    [
        (["link2.offset", "link3.offset"], "d2 + d3"),
        (["joint1.zero", "device.yaw"], "joint 1 zero with base yaw"),
        (["joint1.zero", "placement1.x", "placement2.x", "placement1.yaw"], "joint 1 zero with fixture x, yaw"),
        (["joint1.zero", "seat1.x", "seat2.x", "seat2.y"], "joint 1 zero with seat x, y"),
        (["joint6.zero", "laser.tilt_u"], "joint 6 zero with laser mount tilt_u"),
        (["link6.offset", "tool.z"], "d6 with tool z"),
        (["link2.roll", "joint3.zero", "link3.x"], "link 2 roll with joint 3 zero and link 3 x"),
        (["joint4.zero"], "joint 4 zero"),
    ],
)
def test_combinations_in_the_words_of_who_calibrates(listed, said):
    assert plainly(listed) == said


def test_a_combination_says_its_plain_words():
    J = np.array([[100.0, 100.0, 0.0], [0.0, 0.0, 50.0]])
    (combination,) = analyse(J, names("link2.offset", "link3.offset", "joint2.zero")).combinations
    assert combination.plain == "d2 + d3"


def test_unseen_directions_are_those_that_no_row_feels():
    rng = np.random.default_rng(0)
    J = 1e3 * rng.normal(size=(30, 5)) @ np.diag([1.0, 1.0, 1.0, 0.0, 1.0])
    J[:, 4] = J[:, 0] - 2.0 * J[:, 1]
    seen = analyse(J, names(*(f"joint{i}.zero" for i in range(1, 6))))
    assert seen.unseen.shape == (5, 2)
    np.testing.assert_allclose(J @ seen.unseen, 0.0, atol=1e-9)


def test_indices_of_a_known_spectrum():
    J = np.concatenate([np.diag([8.0, 4.0, 2.0]), np.zeros((5, 3))])
    found = observability(J, names("joint1.zero", "joint2.zero", "joint3.zero"), poses=4)
    assert found.o1 == pytest.approx(4.0 / 2.0)
    assert found.o2 == pytest.approx(2.0 / 8.0)
    assert found.o3 == pytest.approx(2.0)
    assert found.o4 == pytest.approx(4.0 / 8.0)
    assert found.o5 == pytest.approx(1.0 / (1 / 8 + 1 / 4 + 1 / 2))
    assert (found.condition, found.rank, found.well_conditioned) == (4.0, 3, True)
    np.testing.assert_allclose(found.sigma, [1 / 8, 1 / 4, 1 / 2])


def test_indices_of_a_deficient_set_are_zero_and_no_sigma_is_said():
    found = observability(np.ones((4, 2)), names("joint1.zero", "joint2.zero"), poses=4)
    assert (found.o1, found.o2, found.o3, found.o4, found.o5) == (0.0,) * 5
    assert (found.rank, found.n_free) == (1, 2)
    assert np.isinf(found.condition)
    assert np.isinf(found.sigma).all()


def test_more_poses_of_the_same_kind_leave_condition_and_first_index_as_they_are():
    J = np.random.default_rng(1).normal(size=(12, 3))
    listed = names("joint1.zero", "joint2.zero", "joint3.zero")
    once, twice = observability(J, listed, 6), observability(np.concatenate([J, J]), listed, 12)
    assert twice.o1 == pytest.approx(once.o1)
    assert twice.condition == pytest.approx(once.condition)
    assert twice.o3 == pytest.approx(once.o3 * np.sqrt(2.0))


def test_redundant_parameters_are_removed_one_for_each_combination():
    J = np.kron(np.eye(2), np.ones((2, 2))) * 100.0
    listed = names("joint1.zero", "placement1.yaw", "laser.tilt_u", "joint6.zero")
    kept = reduced(listed, analyse(J, listed))
    assert [p.name for p in kept if not p.free] == ["joint1.zero", "joint6.zero"]
    assert analyse(J, kept).combinations == ()


def test_or_held_by_priors_of_their_plausible_size_and_still_without_a_number():
    J = np.kron(np.eye(2), np.ones((2, 2))) * 100.0
    listed = names("joint1.zero", "placement1.yaw", "laser.tilt_u", "joint6.zero")
    seen = analyse(J, listed)
    kept = reduced(listed, seen, Redundant.HELD_BY_PRIORS)
    assert all(p.free and p.prior == p.plausible for p in kept)
    assert analyse(J, kept).combinations == ()
    assert all(seen.reason(p.name) is not None for p in kept)


@dataclass(frozen=True)
class OnACircle:
    """A mark at (x, y) in a frame that turns about the origin by an unknown angle: only its distance is seen."""

    parameters: tuple[Parameter, ...]

    def residual(self, theta):
        return (np.hypot(1.0 + theta[0], theta[1]) - 1.0) * np.array([1e6, -1e6])

    def jacobian(self, theta):
        away = np.array([1.0 + theta[0], theta[1]]) / np.hypot(1.0 + theta[0], theta[1])
        return np.outer([1e6, -1e6], away)


def test_what_an_unseen_turn_shifts_only_to_second_order_is_not_determined_either():
    mark = OnACircle((Parameter("mark.x", "m", 0.1), Parameter("mark.y", "m", 0.1)))
    theta = np.zeros(2)
    at_a_point = analyse(mark.jacobian(theta), mark.parameters)
    assert at_a_point.reason("mark.x") is None  # where the circle runs along y
    seen = analyse_along(mark, theta, mark.parameters)
    assert seen.reason("mark.x") is not None
    assert np.isinf(seen.sigma).all()


@pytest.fixture(scope="module")
def four_poses(request, sessions, ur5e_exact):
    """The paper's case: two and two centred poses, all zeros free between its bounds."""
    rig = load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")
    truth = ur5e_exact()
    truth.zeros = np.random.default_rng(1).uniform(-0.03, 0.03, 6)
    session = sessions(21, n=40, truth=truth, spread=0.0, places=(1,), joint_noise=0.0, psd_noise=0.0)
    rows = np.concatenate([np.flatnonzero(session.first_psd == k)[:2] for k in (1, 2)])
    arm, laser = arm_of(rig), laser_of(rig)
    parameters = tuple(
        Parameter(p.name, p.unit, p.plausible, lower=-BOUND_RAD, upper=BOUND_RAD)
        if p.name.endswith(".zero")
        else Parameter(p.name, p.unit, p.plausible, free=False)
        for p in arm.parameters + laser.parameters
    )
    return PointConstraint(
        arm, laser, session.q_rad[rows], session.first_psd[rows], 5e-6, Constraint.PAIR_POINTS, parameters
    )


def test_the_papers_failure_is_reported_before_any_number(four_poses):
    """All six offsets free: J2 and J3 ran into their bounds in all six of its data sets."""
    fit = solve(four_poses, max_steps=2000)
    seen = analyse(four_poses.jacobian(fit.theta), four_poses.parameters)
    assert fit.status is not Status.CONVERGED
    assert seen.rank < seen.n_free == 6
    assert seen.reason("joint1.zero") == "the measurement does not depend on it"
    assert seen.reason("joint2.zero") is not None
    assert seen.reason("joint3.zero") is not None
    assert observability(four_poses.jacobian(fit.theta), four_poses.parameters, 4).o1 == 0.0


def test_what_an_unseen_combination_hardly_shifts_keeps_its_number():
    """A tenth of its own sigma, for a combination that is off by its plausible size, changes no conclusion."""
    leak = np.array([[1e3, 1e3, 0.0], [0.0, 1e-2, 1e2], [0.0, 0.0, 1e2]])
    J = leak - np.outer(leak @ [1.0, -1.0, 5e-5], [1.0, -1.0, 5e-5]) / 2.0  # unseen: joint1 - joint2, a little joint3
    listed = names("joint1.zero", "joint2.zero", "joint3.zero")
    seen = analyse(J, listed)
    assert [c.members for c in seen.combinations] == [("joint1.zero", "joint2.zero")]
    assert seen.reason("joint3.zero") is None
    np.testing.assert_allclose(J @ seen.unseen, 0.0, atol=1e-5)


def test_what_goes_together_is_never_said_alone_however_unlike_the_sizes():
    listed = (Parameter("link1.offset", "m", 1e-3), Parameter("device.z", "m", 0.2), *names("joint2.zero"))
    J = np.array([[1e5, 1e5, 0.0], [0.0, 0.0, 1e3], [2e5, 2e5, 1e3]])
    (combination,) = analyse(J, listed).combinations
    assert (combination.plain, combination.structural) == ("d1 with base z", True)
