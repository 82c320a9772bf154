"""The paper's point constraint: what four poses can and cannot tell, and what more poses add."""

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.identify.point_constraint import (
    BOUND_RAD,
    Constraint,
    DrawingTolerance,
    PointConstraint,
    drawing_tolerance,
    identify_by_four_poses,
    identify_by_point,
)
from calibrate.fit.solvers import Status
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.dual_psd_rig import laser_of
from calibrate.model.observations import Observations
from calibrate.model.parameters import Parameter, start_values

TOLERANCES = DrawingTolerance(line_m=5e-6, length_m=3e-4, angle_rad=5e-4)


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


def centred(session, each):
    """`each` poses of both orders, as the servo leaves them: spots within 5 um of the centres."""
    rows = np.concatenate([np.flatnonzero(session.first_psd == k)[:each] for k in (1, 2)])
    data = Observations(session.q_rad, session.first_psd, session.placement, session.spots_m)
    return data.select(rows)


@pytest.fixture(scope="module")
def exact(sessions, ur5e_exact):
    """Nothing off but the zeros, no noise."""
    truth = ur5e_exact()
    truth.zeros = np.random.default_rng(1).uniform(-0.03, 0.03, 6)
    return sessions(21, n=40, truth=truth, spread=0.0, places=(1,), joint_noise=0.0, psd_noise=0.0)


def test_enough_poses_of_an_exact_rig_give_every_zero_but_the_first(rig, exact):
    result = identify_by_point(arm_of(rig), laser_of(rig), centred(exact, 5), TOLERANCES)
    assert result.status is Status.RANK_DEFICIENT
    assert result.identifiability.rank == 5
    assert (result.zeros[0].value_rad, result.zeros[0].why) == (None, "the measurement does not depend on it")
    for zero in result.zeros[1:]:
        assert zero.value_rad == pytest.approx(exact.truth.zeros[zero.joint - 1], abs=1e-8)
    assert result.rms_distance_after_m < 1e-9 < 1e-3 < result.rms_distance_before_m


def test_middles_of_the_pairs_lose_an_equation_and_report_no_number(rig, exact):
    """What the paper met: four poses, six offsets, J2 and J3 at their bound."""
    result = identify_by_four_poses(arm_of(rig), laser_of(rig), centred(exact, 2), TOLERANCES)
    assert result.status is Status.RANK_DEFICIENT
    assert result.identifiability.rank == 4
    lost = {name for c in result.identifiability.combinations for name in c.members}
    assert "joint1.zero" in lost
    for zero in result.zeros:
        assert (zero.value_rad is None) == (f"joint{zero.joint}.zero" in lost)
    assert len(lost) >= 3


@pytest.mark.parametrize("seeds", [4, pytest.param(20, marks=pytest.mark.endure)])
def test_drawing_errors_are_in_the_sigma(rig, sessions, seeds):
    z = []
    for seed in range(seeds):
        session = sessions(seed, n=40, spread=0.0, places=(1,))
        for each, identify in ((2, identify_by_four_poses), (6, identify_by_point)):
            result = identify(arm_of(rig), laser_of(rig), centred(session, each), drawing_tolerance(rig))
            found = [zero for zero in result.zeros if zero.value_rad is not None]
            assert all(abs(zero.value_rad) < BOUND_RAD for zero in found)
            z += [(zero.value_rad - session.truth.zeros[zero.joint - 1]) / zero.sigma_rad for zero in found]
    assert len(z) > 5 * seeds
    assert np.mean(np.abs(z) < 3.0) >= 0.98
    assert np.max(np.abs(z)) < 4.5


def test_a_zero_at_its_bound_silences_the_whole_answer(rig, sessions, ur5e_exact):
    truth = ur5e_exact()
    truth.zeros = np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])  # beyond the bound of 0.0785
    session = sessions(22, n=40, truth=truth, spread=0.0, places=(1,), joint_noise=0.0, psd_noise=0.0)
    result = identify_by_point(arm_of(rig), laser_of(rig), centred(session, 5), TOLERANCES)
    assert result.status is Status.AT_BOUND
    assert all(zero.value_rad is None for zero in result.zeros)
    assert any("bound" in str(zero.why) for zero in result.zeros)


@pytest.mark.parametrize("form", list(Constraint))
def test_derivatives_are_differences(rig, exact, form):
    arm, laser = arm_of(rig), laser_of(rig)
    data = centred(exact, 2)
    parameters: tuple[Parameter, ...] = arm.parameters + laser.parameters
    problem = PointConstraint(arm, laser, data.q_rad, data.first_psd, 1.0, form, parameters)
    theta = start_values(parameters) + np.random.default_rng(3).normal(0, 1e-2, len(parameters))
    steps = np.eye(len(theta)) * 1e-6
    numeric = np.stack([(problem.residual(theta + h) - problem.residual(theta - h)) / 2e-6 for h in steps], axis=1)
    np.testing.assert_allclose(problem.jacobian(theta), numeric, atol=5e-9)


def test_poses_of_two_placements_do_not_meet_in_a_point(rig, sessions):
    session = sessions(23, n=20, spread=0.0, places=(1, 2))
    with pytest.raises(DataError, match="poses at placements 1, 2"):
        identify_by_point(arm_of(rig), laser_of(rig), centred(session, 8), TOLERANCES)


def test_both_orders_are_needed(rig, exact):
    data = centred(exact, 4)
    with pytest.raises(DataError, match="4 poses strike PSD 1 first and 0 PSD 2"):
        identify_by_point(arm_of(rig), laser_of(rig), data.select(np.flatnonzero(data.first_psd == 1)), TOLERANCES)


def test_spots_off_centre_are_refused_with_their_pose(rig, exact):
    data = centred(exact, 3)
    spots = data.spots_m.copy()
    spots[4, 2] = 2e-3
    off = Observations(data.q_rad, data.first_psd, data.placement, spots)
    with pytest.raises(DataError, match=r"spots of pose 4 are 0\.002 m off centre"):
        identify_by_point(arm_of(rig), laser_of(rig), off, TOLERANCES)
