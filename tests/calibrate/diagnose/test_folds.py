"""Which samples a proof leaves out."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.diagnose.folds import FEWEST, splits_of, units


def random_split(world, samples):
    session = world.session(np.random.default_rng(4))
    drivers = replace(session.drivers, repeat=None)
    return next(s for s in splits_of(drivers, np.arange(samples), np.random.default_rng(1)) if s.says == "random")


@pytest.mark.parametrize("samples", [20, 25, 40, 47])
def test_a_small_session_is_proved_on_several_shares_in_turn(world, samples):
    folds = random_split(world, samples).unseen
    left_out = np.concatenate(folds)
    assert len(folds) > 1
    assert FEWEST <= len(left_out) == len(np.unique(left_out))
    assert all(len(fold) <= samples / 4 for fold in folds)


def test_a_larger_session_leaves_out_one_share(world):
    (fold,) = random_split(world, 200).unseen
    assert len(fold) == 40


def test_repeats_of_a_pose_are_left_out_together(world):
    drivers = world.session(np.random.default_rng(4)).drivers
    split = next(s for s in splits_of(drivers, np.arange(200), np.random.default_rng(1)) if s.says == "random")
    known = np.setdiff1d(np.arange(200), np.concatenate(split.unseen))
    assert not set(units(drivers)[known]) & set(units(drivers)[np.concatenate(split.unseen)])
