"""A design as a plan: blocks, sides, repeats, an order free of trend, and what a session reads back."""

from itertools import pairwise

import msgspec
import numpy as np
import pytest

from acquisition.recording.pose_plan import read_pose_plan, write_pose_plan
from acquisition.recording.rig import load_rig
from acquisition.session.session import check_planned
from calibeam.motion.reachable_poses import candidates_of, with_grid
from calibrate.design.design import DesignOptions, design, enough_of
from calibrate.design.information import information_of
from calibrate.design.places import choose_places
from calibrate.design.seen import seen_by
from calibrate.errors import DataError
from tests.calibrate.design.conftest import RIG


@pytest.fixture(scope="module")
def made(rig, candidates, information):
    return design(rig, candidates, information, DesignOptions(poses=36, repeats=4))


def test_a_session_can_take_the_plan(rig, made, tmp_path):
    write_pose_plan(tmp_path / "plan.toml", made.plan)
    plan = read_pose_plan(tmp_path / "plan.toml", rig)
    check_planned(plan)
    assert plan == made.plan
    assert plan.poses == 36


def test_the_fixture_is_moved_once_to_each_place(made):
    places = [block.placement for block in made.plan.block]
    assert len(list(dict.fromkeys(places))) == 1 + sum(a != b for a, b in pairwise(places))


def test_repeats_come_from_the_other_side_of_every_joint(made):
    poses = [pose for block in made.plan.block for pose in block.pose]
    groups = {}
    for pose in poses:
        if pose.repeat is not None:
            groups.setdefault(pose.repeat, []).append(pose)
    assert sorted(groups) == [1, 2, 3, 4]
    for first, again in groups.values():
        assert first.q_rad == again.q_rad
        assert [-side for side in first.approach] == list(again.approach)


def test_both_sides_are_as_frequent(made):
    sides = made.taken.approach
    assert np.abs(sides.sum(axis=0)).max() <= 3.0  # one odd pose a place


def test_a_drift_looks_less_like_geometry_than_in_the_order_of_shortest_ways(made):
    assert made.in_time.absorbed < made.in_time.absorbed_before
    assert sorted(made.in_time.poses.tolist()) == sorted(made.choice.poses.tolist())


def test_the_plan_promises_less_error_than_random_poses(made):
    assert made.free_space_m < 0.9 * made.random_m


def test_expected_spots_are_those_of_the_rig_as_drawn(rig, candidates, made):
    from calibrate.model.assumed_rig import AssumedRig

    assumed = AssumedRig(rig)
    for block in made.plan.block:
        for pose in block.pose:
            spots = assumed.spots(np.array(pose.q_rad), block.placement, block.first_psd)
            np.testing.assert_allclose(spots, pose.spots_m, atol=1e-8)


def test_candidates_are_within_limits_above_the_table_and_lit(rig, candidates):
    from acquisition.centring.aim import clear_of_table
    from calibrate.model.assumed_rig import AssumedRig, Light

    assumed = AssumedRig(rig)
    for q, place, first in zip(candidates.q_rad, candidates.placement, candidates.first_psd, strict=True):
        assert assumed.expect(q, int(place), int(first)).light is Light.BOTH_LIT
        assert clear_of_table(assumed.arm, q)
        assert np.all((q >= assumed.arm.lower_rad) & (q <= assumed.arm.upper_rad))


def test_no_candidate_comes_near_a_keep_out_box(rig):
    import msgspec

    from acquisition.motion.cell import body_points
    from acquisition.recording.rig.schema import MotionBox
    from calibeam.motion.gate_of_rig import cell_of, solver_of

    box = MotionBox("post", (0.1, 0.2, 0.0), (0.2, 0.3, 0.6))
    walled = msgspec.structs.replace(rig, motion=msgspec.structs.replace(rig.motion, keep_out=(box,)))
    q, cell = candidates_of(walled, 4, np.random.default_rng(1)).q_rad, cell_of(walled)
    points = body_points(solver_of(walled).arm.frames(q), cell.tool_m)
    assert cell.keep_out[0].distance_m(points).min() >= cell.clearance_m


def test_a_diagnosis_of_the_plan_could_find_causes_and_says_which_it_confuses(rig, candidates, made):
    seen = seen_by(rig, candidates, made.taken, np.random.default_rng(3))
    physics = {one.name.physics for one in seen.smallest}
    assert {"backlash", "encoder-eccentricity", "joint-compliance", "laser-warm-up"} <= physics
    assert all(one.value > 0.0 for one in seen.smallest)
    assert all(r2 >= 0.97 for _, _, r2 in seen.confusable)
    causes = [{(a.physics, a.where), (b.physics, b.where)} for a, b, _ in seen.confusable_causes]
    assert all(len(pair) == 2 for pair in causes)
    assert len({frozenset(pair) for pair in causes}) == len(causes) <= len(seen.confusable)


def test_known_distances_between_places_never_harm(rig):
    wide = with_grid(rig)
    kept = tuple(p for p in wide.placement_list if p.id in (1, 2, 20, 39))
    import msgspec

    few = msgspec.structs.replace(wide, placement_list=kept)
    offered = candidates_of(few, 5, np.random.default_rng(1))
    found = information_of(few, offered, np.random.default_rng(2))
    places = choose_places(found, offered, kept, 40, 20e-6, 3)
    assert [len(one.ids) for one in places] == [1, 2, 3]
    for one in places:
        assert one.with_distances_m <= one.free_space_m * (1.0 + 1e-9)
        assert one.with_distances_scale <= one.scale_sigma * (1.0 + 1e-9)
    sharper = choose_places(found, offered, kept, 40, 1e-9, 3)
    assert sharper[2].with_distances_m < places[2].with_distances_m


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (DesignOptions(criterion="a"), "there are free-space, d, o1"),
        (DesignOptions(poses=500), "72 candidates for 500 poses"),
        (DesignOptions(poses=5, repeats=5), "more poses than repeats"),
    ],
)
def test_what_cannot_be_designed_is_refused(rig, candidates, information, asked, says):
    with pytest.raises(DataError, match=says):
        design(rig, candidates, information, asked)


def test_a_rig_without_an_instrument_is_refused_and_a_measuring_arm_informed_that_it_needs_no_plan():
    arm = load_rig(RIG.with_name("arm-cmm-reference.toml"))
    with pytest.raises(DataError, match="not for cones and bars"):
        candidates_of(arm, 4, np.random.default_rng(1))
    bare = msgspec.structs.replace(arm, seat_list=(), bar_position_list=())
    with pytest.raises(DataError, match="what will be measured"):
        candidates_of(bare, 4, np.random.default_rng(1))


def test_what_could_be_seen_is_asked_with_angles_that_scatter_as_the_rig_believes(rig, candidates, made, monkeypatch):
    asked = []

    def caught(_, samples):
        asked.append(samples.joints())
        raise InterruptedError

    monkeypatch.setattr("calibrate.design.seen.session_of", caught)
    with pytest.raises(InterruptedError):
        seen_by(rig, candidates, made.taken, np.random.default_rng(1))
    scatter_rad = (asked[0] - candidates.q_rad[made.taken.poses]).std()
    assert scatter_rad == pytest.approx(rig.noise.joint_rad, rel=0.2)


@pytest.mark.parametrize(("power", "enough"), [(0.5, 10), (1.0, None)])
def test_poses_are_enough_where_more_only_average(power, enough):
    poses = np.arange(10, 100, 10)
    assert enough_of(poses, poses**-power) == enough


def test_poses_are_enough_behind_the_last_steep_stretch():
    poses = np.arange(10, 200, 10)
    error = np.where(poses < 60, (60 / poses) ** 1.5, (60 / poses) ** 0.5)
    assert enough_of(poses, error) in (50, 60)


def test_poses_before_a_tracker_are_designed_too(rig):
    import msgspec

    from acquisition.recording.rig import Pose
    from acquisition.recording.rig.schema import Tool
    from calibrate.model.rigid import transform

    tracked = msgspec.structs.replace(
        rig,
        fixture=None,
        placement_list=(),
        tool=Tool(point_m=(0.02, 0.01, 0.08)),
        device=Pose((2.0, 0.5, 0.3), (0.0, 0.0, 2.0)),
    )
    offered = candidates_of(tracked, 10, np.random.default_rng(1))
    assumed = offered.reading @ transform((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))[:3, :3].T + [2.0, 0.5, 0.3]
    assert assumed[:, 2].min() > 0.0
    found = information_of(tracked, offered, np.random.default_rng(2))
    made = design(tracked, offered, found, DesignOptions(poses=30, repeats=2))
    assert found.target == "the tool's point"
    assert made.free_space_m < made.random_m
    assert made.plan.block[0].placement is None
