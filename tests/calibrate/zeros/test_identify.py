"""Joint zeros from concealed truths: coverage, convergence, and silence about what cannot be known."""

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.dual_psd_rig import believed_noise, dual_psd_chain
from calibrate.errors import DataError
from calibrate.fit import Status
from calibrate.observations import Observations
from calibrate.zeros.identify import BelievedNoise, fit_weighted, identify

SEEDS = range(20)


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


def observed(session, sigma_m=None):
    return Observations(session.q_rad, session.first_psd, session.placement, session.spots_m, sigma_m, session.repeat)


def run(rig, session, **options):
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    options = {"rng": np.random.default_rng(0), **options}
    return identify(chain, observed(session), options.pop("noise", believed_noise(rig)), **options)


def deviations(result, truth):
    """(error over sigma) of every zero that was reported."""
    return [(z.value_rad - truth.zeros[z.joint - 1]) / z.sigma_rad for z in result.zeros if z.value_rad is not None]


@pytest.fixture(scope="module")
def results(rig, sessions):
    return [(sessions(seed), run(rig, sessions(seed), held_out_share=0.0)) for seed in SEEDS]


def test_98_percent_of_zeros_lie_within_3_sigma_and_none_beyond_4_5(results):
    z = np.abs(np.concatenate([deviations(result, session.truth) for session, result in results]))
    assert len(z) == 4 * len(SEEDS)
    assert np.mean(z < 3.0) >= 0.98
    assert z.max() < 4.5
    assert np.sqrt(np.mean(z**2)) > 0.6  # and sigma is not simply large


def test_measurement_finds_every_zero_from_two_degrees_off(results):
    for session, result in results:
        for z in result.zeros[1:5]:
            assert z.value_rad == pytest.approx(session.truth.zeros[z.joint - 1], abs=2e-5)
            assert z.measurement_sigma_rad <= z.sigma_rad < 1e-5
        assert result.rms_before_m > 1e-3
        assert result.rms_after_m < 5e-6


def test_between_crossing_axes_the_zero_is_the_whole_turn(rig, sessions, ur5e_truth):
    """A link 4 that is tilted about its own axis is a joint 4 with another zero (alpha +90 deg: the same sense)."""
    truth = ur5e_truth(np.random.default_rng(7))
    truth.links[3, 3] = 2e-3
    result = run(rig, sessions(7, truth=truth))
    zero = result.zeros[3]
    assert abs(zero.value_rad - truth.zeros[3] - 2e-3) < 4.5 * zero.sigma_rad


def test_joint_1_and_joint_6_are_never_given_a_number(results):
    for _, result in results:
        for z in result.zeros:
            if z.joint in (1, 6):
                assert (z.value_rad, z.sigma_rad) == (None, None)
        why = {z.joint: z.why for z in result.zeros}
        assert "joint1.zero + placement x, y, yaw" in why[1]
        assert "joint6.zero + laser mount" in why[6]
        undetermined = {e.name for e in result.estimates if e.value is None}
        assert {"placement1.yaw", "placement3.x", "laser.tilt_u", "laser.shift_u"} <= undetermined
        assert result.status is Status.RANK_DEFICIENT
        assert result.identifiability.rank == result.identifiability.n_free - 2


def test_noise_is_found_and_chi_square_agrees(results):
    for _, result in results:
        noise = result.noise
        assert noise.converged
        assert abs(noise.joint_rad - 3e-6) < 4.0 * noise.joint_sigma_rad
        assert abs(noise.psd_m - 2e-6) < 4.0 * noise.psd_sigma_m
        assert 0.7 < noise.chi2_per_dof < 1.3


def test_joints_without_noise_are_said_to_have_none_that_can_be_told(rig, sessions):
    session = sessions(8, joint_noise=0.0)
    result = run(rig, session, held_out_share=0.0)
    assert result.noise.converged
    assert (result.noise.joint_at_zero, result.noise.psd_at_zero) == (True, False)
    assert abs(result.noise.psd_m - 2e-6) < 4.0 * result.noise.psd_sigma_m
    assert all(abs(z) < 4.5 for z in deviations(result, session.truth))


def test_wrong_belief_about_noise_changes_little(rig, sessions):
    right = run(rig, sessions(0), held_out_share=0.0)
    wrong = run(rig, sessions(0), held_out_share=0.0, noise=BelievedNoise(2e-5, 5e-7))
    assert wrong.noise.joint_rad == pytest.approx(right.noise.joint_rad, rel=0.1)
    assert wrong.zeros[1].value_rad == pytest.approx(right.zeros[1].value_rad, abs=right.zeros[1].sigma_rad)
    assert not 0.5 < wrong.noise.chi2_per_dof_believed < 2.0


@pytest.mark.parametrize("n", [10, 15, 30])
def test_few_samples_stay_honest(rig, sessions, n):
    z = [abs(x) for seed in range(12) for x in deviations(run(rig, sessions(seed, n=n)), sessions(seed, n=n).truth)]
    assert len(z) > 30
    assert np.mean(np.array(z) < 3.0) >= 0.96
    assert max(z) < 4.5


def test_one_placement_and_one_order_lose_no_honesty(rig, sessions):
    options = {"n": 30, "places": (2,), "orders": (1,), "spread": 0.3}
    for seed in range(6):
        session = sessions(seed, **options)
        result = run(rig, session)
        assert all(abs(z) < 4.5 for z in deviations(result, session.truth))
        assert {z.joint for z in result.zeros if z.value_rad is not None} <= {2, 3, 4, 5}


def test_held_out_poses_are_predicted_to_the_noise(rig, sessions):
    result = run(rig, sessions(1))
    assert result.held_out is not None
    assert result.held_out.poses == 18
    assert result.held_out.rms_after_m < 6e-6 < 1e-3 < result.held_out.rms_before_m
    assert 0.7 < result.held_out.chi_after < 1.6


def test_repeats_agree_with_the_noise_and_show_no_lack_of_fit(rig, sessions):
    result = run(rig, sessions(2, n=60, repeats=20))
    assert result.repeats is not None
    assert (result.repeats.groups, result.repeats.dof) == (20, 80)
    assert 0.6 < result.repeats.chi2_per_dof < 1.5
    assert result.repeats.lack_of_fit_p > 1e-3


def test_physics_that_the_model_lacks_is_seen_as_lack_of_fit(rig, sessions):
    session = sessions(3, n=60, repeats=20)
    bent = session.q_rad + 3e-4 * np.sin(session.q_rad[:, [1]]) * np.eye(6)[2]  # an eccentric encoder on joint 3
    data = Observations(bent, session.first_psd, session.placement, session.spots_m, None, session.repeat)
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    result = identify(chain, data, believed_noise(rig), rng=np.random.default_rng(0))
    assert result.repeats is not None
    assert result.repeats.lack_of_fit_p < 1e-3


def test_stated_sigmas_of_the_spots_are_used(rig, sessions):
    session = sessions(4, psd_noise=3e-7)
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    data = observed(session, np.full((90, 4), 3e-7))
    result = identify(chain, data, believed_noise(rig), rng=np.random.default_rng(0))
    assert result.noise.psd_believed_m == pytest.approx(3e-7)
    assert all(abs(z) < 4.5 for z in deviations(result, session.truth))
    assert 0.7 < result.noise.chi2_per_dof_believed < 1.4


def test_a_session_refits_from_its_last_values_in_a_few_steps(rig, sessions):
    session = sessions(5)
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    first = fit_weighted(chain, observed(session), believed_noise(rig))
    again = fit_weighted(chain, observed(session), believed_noise(rig), start=first.fit.theta)
    assert again.steps < first.steps
    assert again.steps <= 6
    sigma = np.sqrt(np.diag(first.fit.covariance))
    assert np.all(np.abs(again.fit.theta - first.fit.theta) <= 0.05 * sigma + 1e-12)


def test_same_data_same_seed_same_answer(rig, sessions):
    one, two = run(rig, sessions(6)), run(rig, sessions(6))
    np.testing.assert_array_equal(one.theta, two.theta)
    assert one.held_out == two.held_out


def test_no_poses_are_refused(rig):
    none = np.empty(0, dtype=np.int64)
    data = Observations(np.empty((0, 6)), none, none, np.empty((0, 4)))
    with pytest.raises(DataError, match="no poses at all"):
        identify(dual_psd_chain(rig, none, none), data, believed_noise(rig), rng=np.random.default_rng(0))
