"""What hangs together in time: a level that changes, blocks, repeats; and the floor that repeats set."""

import numpy as np
import pytest

from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.assess.unseen_rows import near_in_time
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.time_left import time_left

SEEDS = 5
SETS = 100


def left(world, seed, noise="white", step=0.0):
    """Of a session whose readings change by `step` sigmas at 55 % of it: a thing that moved, and is in no catalogue."""
    rng = np.random.default_rng(seed)
    session = world.session(rng, noise=noise)
    way = np.random.default_rng(99).normal(size=session.readings.shape[1])
    later = session.drivers.t_s > 0.55 * session.drivers.t_s.max()
    moved = session.readings + step * later[:, None] * way / np.sqrt(np.mean(way**2))
    return world.with_readings(session, moved), rng


def test_noise_leaves_nothing_that_lasts(world):
    for seed in range(SEEDS):
        session, rng = left(world, seed)
        assert time_left(Bench(session), rng) is None


def test_what_moved_once_lasts_and_is_not_consistent(world):
    session, rng = left(world, 1, step=4.0)
    assert time_left(Bench(session), rng) is not None
    assert diagnose(session, rng).verdict is not Verdict.CONSISTENT


def visits(rng, step_m):
    """Misfit (row, 3) of 20 poses that are visited three times early and once late, after something moved."""
    t_s = np.concatenate([np.arange(60.0), 1000.0 + np.arange(20.0)])
    repeat = np.concatenate([np.repeat(np.arange(20), 3), np.arange(20)])
    return 1e-5 * rng.normal(size=(80, 3)) + step_m * (t_s > 500.0)[:, None], repeat, t_s


def test_repeats_far_apart_set_no_floor_where_they_disagree_more():
    assert near_in_time(*visits(np.random.default_rng(1), 4e-5)) == pytest.approx(1e-5, rel=0.25)


def test_repeats_that_agree_at_any_time_are_used_together():
    alarms = [near_in_time(*visits(np.random.default_rng(seed), 0.0)) for seed in range(SEEDS)]
    assert sum(alarm is not None for alarm in alarms) <= 1


@pytest.mark.endure
@pytest.mark.parametrize("noise", ["white", "heavy", "wander"])
def test_noise_of_any_kind_seldom_lasts(world, noise):
    found = [time_left(Bench(session), rng) for session, rng in (left(world, 5000 + i, noise) for i in range(SETS))]
    assert sum(one is not None for one in found) <= 0.03 * SETS
