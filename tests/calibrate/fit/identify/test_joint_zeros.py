"""Joint zeros from concealed truths: coverage, convergence, and silence about what cannot be determined."""

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.accuracy import Alarm
from calibrate.fit.identify.estimates import conditional_sigma
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.rounds import coarse_start, settled_fit
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.solvers import Status
from tests.calibrate.conftest import spot_samples

# Beside those of tests/golden. Zeros of a truth as far off as those of 25 and 29 have every pair of conventions
# tried, for seconds; of such truths the daily run has two, in test_few_samples_stay_honest.
SEEDS, ENDURED = range(20, 23), range(23, 30)


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


def run(rig, session, *, share=0.0, **columns):
    return identify(rig, spot_samples(session, **columns), rng=np.random.default_rng(0), held_out_share=share)


def deviations(result, truth):
    """(error over sigma) of every zero that was reported."""
    return [(z.value_rad - truth.zeros[z.joint - 1]) / z.sigma_rad for z in result.zeros if z.value_rad is not None]


def noise(result, source):
    return next(n for n in result.noise if n.source == source)


@pytest.fixture(scope="module")
def results(rig, sessions):
    return [(sessions(seed), run(rig, sessions(seed))) for seed in SEEDS]


def test_98_percent_of_zeros_lie_within_3_sigma_and_none_beyond_4_5(results):
    within_3_sigma_and_none_beyond_4_5(results)


@pytest.mark.endure
def test_so_do_those_of_more_truths(rig, sessions, results):
    within_3_sigma_and_none_beyond_4_5([*results, *((sessions(seed), run(rig, sessions(seed))) for seed in ENDURED)])


def within_3_sigma_and_none_beyond_4_5(results):
    z = np.abs(np.concatenate([deviations(result, session.truth) for session, result in results]))
    assert len(z) == 4 * len(results)
    assert np.mean(z < 3.0) >= 0.98
    assert z.max() < 4.5
    assert np.sqrt(np.mean(z**2)) > 0.6  # and sigma is not simply large


def test_the_measurement_finds_every_zero_from_two_degrees_off(results):
    for session, result in results:
        for z in result.zeros[1:5]:
            assert z.value_rad == pytest.approx(session.truth.zeros[z.joint - 1], abs=2e-5)
            assert z.measurement_sigma_rad <= z.sigma_rad < 1e-5
        assert result.blunders == ()
        assert result.instruments[0].rms_distance_before_m > 2e-3
        assert result.instruments[0].rms_distance_after_m < 1e-5


def test_between_crossing_axes_the_zero_is_the_whole_turn(rig, sessions, ur5e_truth):
    """A link 4 that is tilted about its own axis is a joint 4 with another zero (alpha +90 deg: the same sense)."""
    truth = ur5e_truth(np.random.default_rng(7))
    truth.links[3, 3] = 2e-3
    zero = run(rig, sessions(7, n=45, truth=truth)).zeros[3]
    assert abs(zero.value_rad - truth.zeros[3] - 2e-3) < 4.5 * zero.sigma_rad


def test_joint_1_and_joint_6_are_never_given_a_number(results):
    for _, result in results:
        for z in result.zeros:
            if z.joint in (1, 6):
                assert (z.value_rad, z.sigma_rad, z.measurement_sigma_rad) == (None, None, None)
        why = {z.joint: z.why for z in result.zeros}
        assert "joint1.zero + placement x, y, yaw" in why[1]
        assert "joint6.zero + laser mount" in why[6]
        undetermined = {e.name for e in result.estimates if e.value is None}
        assert {"placement1.yaw", "placement3.x", "laser.tilt_u", "laser.shift_u"} <= undetermined
        assert result.status is Status.RANK_DEFICIENT
        assert result.identifiability.rank == result.identifiability.n_free - 2


def test_noise_of_joints_and_detectors_is_found_and_chi_square_agrees(results):
    for _, result in results:
        assert result.noise_settled
        for source, true in (("joint", 3e-6), ("psd", 2e-6)):
            found = noise(result, source)
            assert abs(found.found - true) < 4.0 * found.sigma


def test_joints_without_noise_are_reported_as_not_to_be_distinguished_from_none(rig, sessions):
    session = sessions(8, n=45, joint_noise=0.0)
    result = run(rig, session)
    assert result.noise_settled
    assert (noise(result, "joint").at_zero, noise(result, "psd").at_zero) == (True, False)
    assert abs(noise(result, "psd").found - 2e-6) < 4.0 * noise(result, "psd").sigma
    assert all(abs(z) < 4.5 for z in deviations(result, session.truth))


def test_a_wrong_assumption_about_noise_changes_little_and_raises_an_alarm(rig, sessions):
    session = sessions(0, n=45)
    right = run(rig, session)
    stated = msgspec.structs.replace(rig.noise, joint_rad=2e-5, psd_m=5e-7)
    wrong = run(msgspec.structs.replace(rig, noise=stated), session)
    assert noise(wrong, "joint").found == pytest.approx(noise(right, "joint").found, rel=0.1)
    assert wrong.zeros[1].value_rad == pytest.approx(right.zeros[1].value_rad, abs=right.zeros[1].sigma_rad)
    assert wrong.stated_noise.alarm is not Alarm.NONE


@pytest.mark.parametrize("n", [pytest.param(n, marks=pytest.mark.endure) for n in (10, 15, 30)])
def test_few_samples_stay_honest(rig, sessions, n):
    z = [abs(x) for seed in range(12) for x in deviations(run(rig, sessions(seed, n=n)), sessions(seed, n=n).truth)]
    assert len(z) > 30
    assert np.mean(np.array(z) < 3.0) >= 0.96
    assert max(z) < 4.5


def test_one_placement_and_one_order_lose_no_honesty(rig, sessions):
    options = {"n": 30, "places": (2,), "orders": (1,), "spread": 0.3}
    for seed in (0, 3):
        session = sessions(seed, **options)
        result = run(rig, session)
        assert all(abs(z) < 4.5 for z in deviations(result, session.truth))
        assert {z.joint for z in result.zeros if z.value_rad is not None} <= {2, 3, 4, 5}


def test_poses_held_out_at_random_are_predicted_to_the_noise(rig, sessions):
    first = run(rig, sessions(8), share=0.2).held_out[0]
    assert first.observations == 18
    assert first.rms_distance_after_m < 1.2e-5 < 2e-3 < first.rms_distance_before_m
    assert 0.7 < first.chi_after < 1.6


def test_repeats_agree_with_the_noise_and_show_no_lack_of_fit(rig, sessions):
    repeats = run(rig, sessions(3, n=60, repeats=20)).repeats
    assert (repeats.groups, repeats.dof) == (20, 80)
    assert 0.6 < repeats.chi2_per_dof < 1.5
    assert repeats.p_above > 1e-3


def test_physics_that_the_model_lacks_is_seen_as_lack_of_fit(rig, sessions):
    session = sessions(3, n=60, repeats=20)
    bent = session.q_rad + 3e-4 * np.sin(session.q_rad[:, [1]]) * np.eye(6)[2]  # an eccentric encoder on joint 3
    result = run(rig, session, q_rad=bent)
    assert result.repeats.alarm is Alarm.LACK_OF_FIT
    assert result.repeats.p_above < 1e-3


def test_stated_sigmas_of_the_spots_are_used(rig, sessions):
    session = sessions(4, n=45, psd_noise=3e-7)
    result = run(rig, session, sigma_m=3e-7)
    assert noise(result, "psd").assumed == pytest.approx(3e-7)
    assert all(abs(z) < 4.5 for z in deviations(result, session.truth))
    assert 0.7 < result.stated_noise.chi2 / result.stated_noise.dof < 1.4


def test_a_fit_from_its_last_values_takes_few_steps_and_ends_there(rig, sessions):
    weighting = instruments_for_fit(rig, spot_samples(sessions(5))).weighting
    first = settled_fit(weighting, coarse_start(weighting, np.array([p.start for p in weighting.parameters])))
    again = settled_fit(weighting, first.fit.theta)
    assert again.steps < first.steps
    sigma = np.sqrt(np.diag(first.fit.covariance))
    assert np.all(np.abs(again.fit.theta - first.fit.theta) <= 0.05 * sigma + 1e-12)


def test_the_coarse_start_moves_zeros_and_places_and_leaves_what_a_prior_speaks_of(rig, sessions):
    session = sessions(5)
    weighting = instruments_for_fit(rig, spot_samples(session)).weighting
    drawn = np.array([p.start for p in weighting.parameters])
    start = coarse_start(weighting, drawn)
    by = {p.name: (p, a, b) for p, a, b in zip(weighting.parameters, drawn, start, strict=True)}
    assert all(a == b for p, a, b in by.values() if np.isfinite(p.prior))
    assert by["joint3.zero"][2] == pytest.approx(session.truth.zeros[2], abs=3e-3)


def test_the_sigma_of_the_measurement_is_that_with_the_rest_known_exactly():
    J = np.random.default_rng(3).normal(size=(40, 4))
    covariance = np.linalg.inv(J.T @ J)
    alone = np.sqrt(np.linalg.inv(J[:, :2].T @ J[:, :2])[0, 0])
    assert conditional_sigma(covariance, 0, np.array([2, 3])) == pytest.approx(alone)
    assert conditional_sigma(covariance, 0, np.array([], dtype=np.intp)) == pytest.approx(np.sqrt(covariance[0, 0]))


def test_same_samples_same_seed_same_answer(rig, sessions):
    one, two = (run(rig, sessions(6, n=30), share=0.2) for _ in range(2))
    np.testing.assert_array_equal(one.theta, two.theta)
    assert one.held_out == two.held_out


def test_no_poses_are_refused(rig, sessions):
    none = spot_samples(sessions(6, n=30)).take(np.array([], dtype=np.intp))
    with pytest.raises(DataError):
        identify(rig, none, rng=np.random.default_rng(0))
