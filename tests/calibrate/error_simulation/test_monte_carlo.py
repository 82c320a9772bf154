"""Drawn arms: beside linear propagation, with any number of workers, in bounded memory, where nothing is linear."""

import tracemalloc

import numpy as np
import pytest

from calibrate.error_simulation.monte_carlo import CHUNK, draw_arms
from calibrate.error_simulation.sensitivity import indices_of, propagate
from calibrate.error_simulation.simulate import worst_postures


def test_drawn_arms_agree_with_linear_propagation_where_errors_are_small(machine, poses, every):
    linear = propagate(machine, every, poses)
    drawn = draw_arms(machine, every, poses, 60_000, seed=1, rms_m=linear.rms_m)
    np.testing.assert_allclose(drawn.rms_m, linear.rms_m, rtol=0.01)
    np.testing.assert_allclose(drawn.sigma_m, linear.sigma_m, rtol=0.02)
    np.testing.assert_allclose(drawn.mean_m, linear.bias_m, atol=0.02 * linear.rms_m.max())


def test_any_number_of_workers_gives_the_same_answer_to_the_bit(machine, poses, every):
    rms = propagate(machine, every, poses).rms_m
    one, three = (draw_arms(machine, every, poses, 3 * CHUNK + 7, seed=4, rms_m=rms, workers=w) for w in (1, 3))
    for name in ("arms", "mean_m", "covariance_m2", "mean_length_m", "worst_m", "worst_arm", "histogram"):
        assert np.array_equal(getattr(one, name), getattr(three, name)), name


def test_another_seed_draws_other_arms(machine, poses, every):
    rms = propagate(machine, every, poses).rms_m
    a, b = (draw_arms(machine, every, poses, 500, seed=seed, rms_m=rms) for seed in (1, 1 + 2**32))
    assert not np.array_equal(a.mean_m, b.mean_m)


def test_memory_does_not_grow_with_the_arms(machine, poses, every):
    rms, peaks = propagate(machine, every, poses).rms_m, []
    for chunks in (2, 12):
        tracemalloc.start()
        draw_arms(machine, every, poses, chunks * CHUNK, seed=1, rms_m=rms)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0] + 50_000


def test_progress_ends_at_all_arms(machine, poses, every):
    lines = []
    rms = propagate(machine, every, poses).rms_m
    draw_arms(machine, every, poses, CHUNK + 1, seed=1, rms_m=rms, progress=lambda *x: lines.append(x))
    assert lines == [(CHUNK, CHUNK + 1), (CHUNK + 1, CHUNK + 1)]


def test_quantiles_of_a_radial_normal_error_are_those_of_its_law(machine, poses, stated):
    sources = stated({"what": ("link6.x", "link6.y", "link6.z"), "scale_m": 1e-4})
    rms = propagate(machine, sources, poses).rms_m
    drawn = draw_arms(machine, sources, poses, 100_000, seed=2, rms_m=rms)
    np.testing.assert_allclose(drawn.quantile_m(0.95), 2.7955e-4, rtol=0.01)  # chi of 3 degrees of freedom


def test_large_angles_are_not_linear_and_only_drawing_shows_it(machine, poses, stated):
    sources = stated({"what": ("joint2.zero", "joint4.zero"), "scale_rad": 0.5})
    linear = propagate(machine, sources, poses)
    drawn = draw_arms(machine, sources, poses, 40_000, seed=1, rms_m=linear.rms_m)
    assert np.all(np.linalg.norm(drawn.mean_m, axis=1) > 0.05 * linear.rms_m)
    assert np.all(linear.bias_m == 0.0)


def test_sobol_indices_of_small_errors_are_the_linear_shares(machine, poses, every):
    found = indices_of(machine, every, poses[:3], seed=1, points=256, scrambles=4)
    shares = propagate(machine, every, poses[:3]).shares
    np.testing.assert_allclose(found.total, shares, atol=0.01)
    np.testing.assert_allclose(found.first, shares, atol=0.03)
    assert np.all(found.total_sigma < 0.01)


def test_all_of_the_spread_is_that_of_a_single_error(machine, poses, stated):
    sources = stated({"what": ("joint2.zero",), "scale_rad": 1e-4})
    found = indices_of(machine, sources, poses[:3], seed=1, points=256, scrambles=4)
    np.testing.assert_allclose(found.first, [1.0], atol=0.03)
    np.testing.assert_allclose(found.total, [1.0], atol=0.01)


def test_errors_that_act_together_have_larger_total_than_first_indices(machine, poses, stated):
    sources = stated({"what": ("joint2.zero", "joint4.zero"), "scale_rad": 1.0})
    found = indices_of(machine, sources, poses[:3], seed=1, points=1024, scrambles=4)
    assert np.all(found.total - found.first > 0.02)
    assert found.first.sum() < 0.98


def test_no_drawn_posture_is_worse_than_the_worst(machine, every):
    worst = worst_postures(machine, every, np.random.default_rng(1), drawn=300)
    others = propagate(machine, every, machine.drawn_poses(3000, np.random.default_rng(2))).rms_m
    assert worst[0].rms_m >= others.max()
    inside = (worst[0].q_rad >= machine.lower_rad) & (worst[0].q_rad <= machine.upper_rad)
    assert inside.all()


def test_nothing_drawn_is_refused(machine, poses, every):
    with pytest.raises(ValueError, match="at least one"):
        draw_arms(machine, every, poses, 0, seed=1, rms_m=np.ones(len(poses)))
