"""Which samples a proof leaves out."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.unseen_rows import blocks, regions, splits_of, units


def random_split(world, samples):
    session = world.session(np.random.default_rng(4))
    drivers = replace(session.drivers, repeat=None)
    return next(s for s in splits_of(drivers, np.arange(samples), np.random.default_rng(1)) if s.says == "random")


@pytest.mark.parametrize("samples", [20, 25, 40, 47])
def test_a_small_session_is_proved_on_several_shares_in_turn(world, samples):
    folds = random_split(world, samples).unseen
    left_out = np.concatenate(folds)
    assert len(folds) > 1
    assert limits.FEWEST_LEFT_OUT <= len(left_out) == len(np.unique(left_out))
    assert all(len(fold) <= samples / 4 for fold in folds)


def test_a_larger_session_leaves_out_one_share(world):
    (fold,) = random_split(world, 200).unseen
    assert len(fold) == 40


def test_repeats_of_a_pose_are_left_out_together(world):
    drivers = world.session(np.random.default_rng(4)).drivers
    split = next(s for s in splits_of(drivers, np.arange(200), np.random.default_rng(1)) if s.says == "random")
    known = np.setdiff1d(np.arange(200), np.concatenate(split.unseen))
    assert not set(units(drivers)[known]) & set(units(drivers)[np.concatenate(split.unseen)])


@pytest.mark.parametrize(("parts_of", "count"), [(blocks, 50), (regions, 8)])
def test_parts_hold_visits_of_a_pose_together_and_are_small(world, parts_of, count):
    drivers = world.session(np.random.default_rng(4)).drivers
    parts = parts_of(drivers)
    for visited in np.unique(units(drivers)):
        assert len(np.unique(parts[units(drivers) == visited])) == 1
    assert parts.min() >= 0
    assert parts.max() < count
    assert np.bincount(parts).max() <= 0.3 * len(drivers.t_s)


def test_a_block_is_of_neighbours_in_time_and_a_region_of_neighbours_in_space(world):
    drivers = replace(world.session(np.random.default_rng(4)).drivers, repeat=None)
    n, x = len(drivers.t_s), np.random.default_rng(1).random(len(drivers.t_s))
    frames = drivers.frames.copy()
    frames[:, -1, 0, 3] = x
    drivers = replace(drivers, frames=frames)
    order, block, region = np.argsort(np.argsort(drivers.t_s)), blocks(drivers), regions(drivers)
    for one in range(50):
        assert np.ptp(order[block == one]) < n / 25
    for one in range(8):
        assert np.ptp(x[region == one]) < 0.3


@pytest.mark.parametrize("samples", [20, 31, 60, 150])
def test_folds_of_blocks_in_time_are_of_one_size_however_few_samples(world, samples):
    drivers = world.session(np.random.default_rng(4)).drivers
    drivers = replace(drivers, t_s=drivers.t_s[:samples], repeat=None)
    block = blocks(drivers)
    assert np.ptp(np.bincount(block % limits.FOLDS)) <= limits.FOLDS
    assert np.bincount(block).min() >= 3  # a single one is half seen by its neighbours


def test_a_pose_that_is_visited_again_belongs_to_the_block_of_its_first_visit(world):
    drivers = world.session(np.random.default_rng(4)).drivers
    n = len(drivers.t_s)
    repeat = np.full(n, -1)
    repeat[[3, n - 1]] = 0
    backwards = replace(drivers, repeat=repeat, t_s=drivers.t_s.max() - drivers.t_s)
    assert blocks(backwards)[3] == blocks(backwards)[n - 1] == blocks(replace(backwards, repeat=None))[n - 1]
