"""How good a fit is: chi-square and the error over the workspace.

Chi-square: silent where noise is as stated, an alarm with its name where it is not.

Free-space error: what is predicted is what is found against the truth, frames aside.

Twenty sessions, and sixty: as many 95 % intervals hold the truth as chance allows.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from benchmarks import coverage
from benchmarks.drawn_sessions import TARGET_M
from calibrate.fit.accuracy import (
    ALARM_P,
    Alarm,
    FreeSpaceStatus,
    PoseScatter,
    Workspace,
    against_repeats,
    against_stated,
    free_space_error,
    without_rigid_motion,
)
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.solvers import solve
from calibrate.model.alignment import aligned_difference

ROOM = Workspace(np.full(6, -2.5), np.full(6, 2.5), TARGET_M, 400)


def test_noise_as_stated_is_no_alarm(fitted):
    fit = fitted(1).fit
    found = against_stated(fit.chi2, fit.dof)
    assert found.alarm is Alarm.NONE
    assert ALARM_P < found.p_above < 1.0 - ALARM_P
    assert found.noise_factor == pytest.approx(1.0, abs=0.25)


def test_noise_twice_the_stated_is_an_alarm_and_its_size_is_said(fitted):
    fit = fitted(1, noise=2.0).fit
    found = against_stated(fit.chi2, fit.dof)
    assert found.alarm is Alarm.ABOVE_STATED
    assert found.p_above < 1e-6
    assert 1.5 < found.noise_factor < 2.2  # drawn links and frames take up a little


def test_overstated_noise_is_an_alarm_too(fitted):
    one = fitted(1)
    timid = replace(one.problem, whitener=one.problem.whitener / 3.0)
    residual = timid.residual(one.fit.theta)
    found = against_stated(float(residual @ residual), one.fit.dof)
    assert found.alarm is Alarm.BELOW_STATED


def test_without_redundancy_nothing_is_said_about_noise(fitted):
    found = against_stated(fitted(1).fit.chi2, 0)
    assert found.alarm is Alarm.NO_REDUNDANCY
    assert np.isnan(found.p_above)
    assert np.isnan(found.noise_factor)


def repeated(rng, bias):
    """30 poses measured three times each: unit noise, and a bias of each pose that the model does not know."""
    repeat = np.repeat(np.arange(30), 3)
    return rng.normal(size=(90, 2)) + bias * rng.normal(size=(30, 2))[repeat], repeat


def as_fit(fit, residual):
    return replace(fit, chi2=float(np.sum(residual**2)), dof=residual.size)


def test_misfit_that_repeats_is_lack_of_fit_whatever_noise_was_stated(fitted):
    fit, rng = fitted(1).fit, np.random.default_rng(3)
    for stated in (0.2, 1.0, 5.0):
        honest, repeat = repeated(rng, 0.0)
        missing, _ = repeated(rng, 2.0)
        assert against_repeats(as_fit(fit, honest / stated), honest / stated, repeat).alarm is Alarm.NONE
        found = against_repeats(as_fit(fit, missing / stated), missing / stated, repeat)
        assert found.alarm is Alarm.LACK_OF_FIT
        assert found.chi2_per_dof == pytest.approx(1.0 / stated**2, rel=0.3)
        assert (found.groups, found.dof) == (30, 120)


def test_rows_that_do_not_repeat_give_no_answer(fitted):
    residual, _ = repeated(np.random.default_rng(4), 0.0)
    fit = as_fit(fitted(1).fit, residual)
    assert against_repeats(fit, residual, np.full(90, -1)) is None
    assert against_repeats(fit, residual, np.arange(90)) is None


def found_error_m(one):
    """Rms distance of the fitted from the true target over the workspace, after the best rigid motion."""
    q_rad = np.random.default_rng(9).uniform(-2.5, 2.5, (400, 6))
    names = [p.name for p in one.problem.parameters]
    true = np.array([one.truth.get(name, 0.0) for name in names])
    points = []
    for theta in (one.fit.theta, true):
        own = theta[: len(one.model.parameters)]
        tool = theta[[names.index(f"tool.{a}") for a in "xyz"]]
        T = one.model.flange(own, q_rad)
        points.append(T[:, :3, :3] @ (TARGET_M + tool) + T[:, :3, 3])
    return np.sqrt(np.mean(np.sum(aligned_difference(*points) ** 2, axis=1)))


def test_predicted_error_is_the_one_found_against_the_truth(fitted):
    found, said = [], []
    for seed in range(12):
        one = fitted(50 + seed, poses=60)
        error = free_space_error(one.model, one.fit, one.seen, ROOM, np.random.default_rng(0))
        assert error.status is FreeSpaceStatus.PREDICTED
        assert error.mean_m < error.p95_m < error.max_m
        found.append(found_error_m(one))
        said.append(error.mean_m)
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(np.mean(said), rel=0.2)


def test_it_does_not_matter_which_member_of_an_unseen_combination_is_held(fitted):
    one = fitted(60, poses=60)
    error = free_space_error(one.model, one.fit, one.seen, ROOM, np.random.default_rng(0))
    yaw = next(c for c in one.seen.combinations if "joint1.zero" in c.members)
    other = next(name for name in yaw.members if name.startswith("device."))
    swapped = tuple(
        replace(p, free=True) if p.name == yaw.representative else replace(p, free=p.free and p.name != other)
        for p in one.problem.parameters
    )
    again = solve(one.problem.with_parameters(swapped))
    assert free_space_error(one.model, again, one.seen, ROOM, np.random.default_rng(0)).mean_m == pytest.approx(
        error.mean_m, rel=1e-3
    )


def test_poses_that_leave_something_open_get_no_number(fitted):
    one = fitted(61, poses=60)
    fixed = one.problem.q_rad.copy()
    fixed[:, 4] = 0.3  # joint 5 never moves: its zero and the links around it cannot be determined
    everything = replace(one.problem, q_rad=fixed, parameters=one.problem.chain.parameters)
    wide = tuple(replace(p, prior=np.inf) for p in everything.parameters)
    seen = analyse(everything.jacobian(np.zeros(len(wide))), wide)
    error = free_space_error(one.model, one.fit, seen, ROOM, np.random.default_rng(0))
    assert (error.status, error.mean_m) == (FreeSpaceStatus.UNDETERMINED, None)
    assert error.undetermined


def test_a_rigid_motion_of_everything_is_no_error():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(50, 3))
    v, w = rng.normal(size=3), rng.normal(size=3)
    moved = (v + np.cross(w, points))[:, :, None]
    bent = np.concatenate([moved, moved * points[:, :1, None]], axis=2)
    left = without_rigid_motion(points, bent)
    np.testing.assert_allclose(left[..., 0], 0.0, atol=1e-12)
    assert np.abs(left[..., 1]).max() > 0.1


def test_scatter_of_a_pose_adds_in_squares(fitted):
    one = fitted(60, poses=60)

    def rms_m(scatter):
        found = free_space_error(one.model, one.fit, one.seen, ROOM, np.random.default_rng(0), scatter)
        return found.rms_m

    alone, of_target, of_joints = (
        rms_m(PoseScatter()),
        rms_m(PoseScatter(target_m=2e-5)),
        rms_m(PoseScatter(joint_rad=1e-5)),
    )
    assert of_target == pytest.approx(np.hypot(alone, np.sqrt(3.0) * 2e-5), rel=1e-9)
    assert 5e-6 < np.sqrt(of_joints**2 - alone**2) < 3e-5  # 10 urad at an arm of 0.9 m, six joints


def test_what_the_poses_hardly_show_counts_with_its_plausible_size(fitted):
    one = fitted(60, poses=60)
    weak = replace(one.seen.combinations[0], structural=False)
    length = one.seen.names.index("link2.length")
    unseen = np.zeros((len(one.seen.names), 1))
    unseen[length] = 1e-3
    seen = replace(one.seen, combinations=(weak,), unseen=unseen)
    sure, guess = (free_space_error(one.model, one.fit, s, ROOM, np.random.default_rng(0)) for s in (one.seen, seen))
    assert guess.status is FreeSpaceStatus.PREDICTED
    assert guess.guessed == (weak.plain,)
    assert 1e-4 < np.sqrt(guess.rms_m**2 - sure.rms_m**2) < 1e-3


@pytest.fixture(autouse=True)
def _one_bench(monkeypatch, bench):
    monkeypatch.setattr(coverage, "Bench", lambda _: bench)


@pytest.mark.parametrize("sessions", [20, pytest.param(60, marks=pytest.mark.endure)])
def test_intervals_keep_their_word(request, sessions):
    tally = coverage.run(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml", sessions=sessions, seed=7)
    assert tally.failed == 0
    assert {key[0] for key in tally.stated} == {"tracker", "dual PSD"}
    stated, held = sum(tally.stated.values()), sum(tally.held.values())
    # members of a session share its noise: a sixth of the intervals count as independent, about four a session
    low, high = binom.ppf([0.001, 0.999], stated // 6, coverage.LEVEL) / (stated // 6)
    assert low <= held / stated <= high


def test_what_is_not_determined_is_not_counted(request):
    tally = coverage.run(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml", sessions=2, seed=8)
    assert tally.stated["dual PSD", "joint zero"] == 4  # joint 1 turns with the fixture, joint 6 with the laser
    assert tally.stated["tracker", "device yaw"] == 0  # joint 1 turns with the device
