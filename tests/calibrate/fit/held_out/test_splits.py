"""Splits: what is left out, and that nothing is left out twice."""

import numpy as np

from calibrate.fit.held_out.splits import (
    SplitKind,
    at_random,
    by_place,
    last_block,
    same_poses,
    usual,
)


def test_a_random_fifth_is_another_one_with_another_seed():
    (one,), (other,) = (at_random(50, np.random.default_rng(seed)).unseen for seed in (0, 1))
    assert len(set(one.tolist())) == len(one) == 10
    assert set(one.tolist()) != set(other.tolist())


def test_every_row_is_unseen_once_when_places_go_in_turn():
    folds = by_place(np.array([3, 1, 3, 2, 1])).unseen
    assert [fold.tolist() for fold in folds] == [[1, 4], [3], [0, 2]]


def test_rows_without_a_place_are_never_left_out():
    assert [fold.tolist() for fold in by_place(np.array([-1, 4, -1, 0])).unseen] == [[3], [1]]


def test_only_the_kinds_that_are_asked_for_are_made():
    t_s, rng = np.arange(10.0), np.random.default_rng(0)
    (one,) = usual(10, rng, t_s=t_s, share=0.3, kinds=(SplitKind.LAST, SplitKind.PLACE))
    assert (one.says, len(one.unseen[0])) == ("last 30% of the session", 3)
    assert usual(10, rng, t_s=np.zeros(10), kinds=(SplitKind.LAST,)) == ()


def test_the_last_block_goes_by_time_and_not_by_row():
    (fold,) = last_block(np.array([5.0, 0.0, 9.0, 1.0, 2.0]), share=0.4).unseen
    assert fold.tolist() == [0, 2]


def test_one_place_is_no_split_by_place():
    rng = np.random.default_rng(0)
    assert len(usual(10, rng)) == 1
    assert len(usual(10, rng, place=np.ones(10, dtype=int), t_s=np.arange(10.0))) == 2
    assert len(usual(10, rng, place=np.arange(10) % 2, t_s=np.arange(10.0))) == 3


def test_rows_of_one_pose_are_unseen_together():
    """Six poses, three visits each: a pose that was visited before is not unseen."""
    pose, t_s = np.tile(np.arange(6), 3), np.arange(18.0)
    for split in usual(18, np.random.default_rng(2), t_s=t_s, pose=pose):
        (unseen,) = split.unseen
        assert set(pose[unseen].tolist()).isdisjoint(np.delete(pose, unseen).tolist())
        assert 3 <= len(unseen) <= 6
    (last,) = last_block(t_s, 1.0 / 6.0, pose).unseen
    assert set(pose[last].tolist()) == {5}  # the one that first came last


def test_a_pose_is_known_by_its_joints():
    q_rad = np.array([[0.1, 0.2], [1.0, 0.2], [0.105, 0.195], [np.nan, 0.0], [1.0, 0.2], [np.nan, 0.0]])
    assert same_poses(q_rad).tolist() == [0, 1, 0, 2, 1, 3]
