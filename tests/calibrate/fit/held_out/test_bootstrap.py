"""Bootstrap: the same doubt as the covariance where that is right, more where the noise is not as stated."""

import numpy as np
import pytest

from calibrate.fit.held_out.held_out import bootstrap


def share(one, drawn):
    """Bootstrap sigma over stated sigma of the free parameters."""
    free = [i for i, p in enumerate(one.problem.parameters) if p.free]
    return drawn.sigma()[free] / np.sqrt(np.diag(one.fit.covariance))[free]


def test_honest_noise_gives_the_stated_sigma(fitted):
    one = fitted(70, poses=120)
    drawn = bootstrap(one.problem, one.fit, np.random.default_rng(0), rounds=100)
    assert drawn.failed == 0
    assert np.median(share(one, drawn)) == pytest.approx(1.0, abs=0.2)
    low, high = drawn.interval().T
    assert np.all(low <= high)


def test_noise_beyond_the_stated_is_felt(fitted):
    one = fitted(70, poses=120, noise=4.0)
    drawn = bootstrap(one.problem, one.fit, np.random.default_rng(0), rounds=60)
    zero = [p.name for p in one.problem.parameters].index("joint3.zero")
    assert drawn.sigma()[zero] > 2.0 * np.sqrt(one.fit.covariance[zero, zero])


def test_rows_of_a_group_go_together_and_lost_rank_is_counted(fitted):
    one = fitted(71, poses=40)
    drawn = bootstrap(one.problem, one.fit, np.random.default_rng(0), rounds=5, group=np.arange(40) // 39)
    assert drawn.failed + len(drawn.theta) == 5
    assert drawn.failed > 0  # a draw of the one odd pose alone cannot place the device


def test_rows_that_are_stated_and_not_sampled_are_in_every_draw(fitted):
    one = fitted(71, poses=40)
    group = np.where(np.arange(40) == 39, 0, -1)  # one pose to draw, all others stated: every draw is the session
    drawn = bootstrap(one.problem, one.fit, np.random.default_rng(0), rounds=3, group=group)
    free = [i for i, p in enumerate(one.problem.parameters) if p.free and np.isinf(p.prior)]
    spread = np.ptp(drawn.theta[:, free], axis=0)
    honest = np.ptp(bootstrap(one.problem, one.fit, np.random.default_rng(0), rounds=3).theta[:, free], axis=0)
    assert drawn.failed == 0
    assert np.median(spread / honest) < 0.5
