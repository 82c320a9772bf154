"""What a session says of its accuracy: no number before there is one, and the number of a design when all is taken."""

import numpy as np
import pytest

from acquisition.session.plan import PlanOptions, blocks
from calibeam.sessions.forecast import ahead_of_blocks, forecast
from calibrate.design.information import information_of

GOAL_M = 10e-6


@pytest.mark.parametrize("taken", [0, 1, 2])
def test_before_the_poses_determine_it_there_is_no_number(rig, ahead, samples, taken) -> None:
    ahead_of_fit = forecast(rig, samples[:taken], ahead.after(taken), GOAL_M)
    assert ahead_of_fit.now_m is ahead_of_fit.more is ahead_of_fit.end_m is None
    assert ahead_of_fit.says.startswith("not determined yet: ")
    assert ahead_of_fit.why


def test_the_whole_plan_brings_what_a_design_promises(rig, ahead, samples) -> None:
    """Under the noise that is found in the samples, which here is as believed: 90 poses know it to some per cent."""
    ahead_of_fit = forecast(rig, samples, ahead.after(len(samples)), GOAL_M)
    # A design takes the sigma of a single reading for that of a spot, these samples state that of their mean.
    poses = ahead.poses
    designed = information_of(rig, poses, np.random.default_rng(1))
    assert ahead_of_fit.now_m is not None
    assert ahead_of_fit.now_m == ahead_of_fit.end_m
    assert 0.2 < ahead_of_fit.now_m / designed.free_space_m(designed.of(np.arange(len(poses)))) < 1.0


def test_the_promised_number_of_poses_brings_it_under_the_goal(rig, ahead, samples) -> None:
    early = forecast(rig, samples[:20], ahead.after(20), GOAL_M)
    assert early.now_m is not None
    assert early.now_m > GOAL_M
    assert early.more is not None
    later = forecast(rig, samples[: 20 + early.more], ahead.after(20 + early.more), GOAL_M)
    assert later.now_m == pytest.approx(GOAL_M, rel=0.25)  # the noise is known better by then
    assert f"{early.more} more poses bring it under 10 µm" in early.says


def test_a_goal_that_the_plan_does_not_reach_is_said(rig, ahead, samples) -> None:
    ahead_of_fit = forecast(rig, samples[:30], ahead.after(30), 1e-6)
    assert ahead_of_fit.more is None
    assert ahead_of_fit.end_m is not None
    assert "the whole plan brings it to" in ahead_of_fit.says
    assert ahead_of_fit.end_m > 1e-6


def test_a_goal_that_is_reached_needs_no_more(rig, ahead, samples) -> None:
    ahead_of_fit = forecast(rig, samples, ahead.after(len(samples)), 1e-3)
    assert ahead_of_fit.more == 0
    assert ahead_of_fit.says.endswith("under 1 mm")


@pytest.mark.parametrize("taken", [4, 8, 20])
def test_what_is_known_now_does_not_depend_on_what_is_planned(rig, ahead, samples, taken) -> None:
    now = forecast(rig, samples[:taken], ahead.after(taken), GOAL_M).now_m
    alone = forecast(rig, samples[:taken], ahead.after(len(samples)), GOAL_M).now_m
    assert (now is None) is (alone is None)
    assert alone == pytest.approx(now, rel=1e-3)


def test_poses_at_one_place_in_one_order_do_not_pass_for_a_calibration(rig, samples) -> None:
    """A short plan whose remaining poses show no more than those taken: what they cannot tell stays in the number."""
    plan = tuple(blocks((1,), 0.01, PlanOptions(repeats=0)))[:1]
    ahead_of_fit = forecast(rig, samples[:8], ahead_of_blocks(rig, plan).after(8), 1e-6)
    assert ahead_of_fit.now_m is None or ahead_of_fit.now_m > 50e-6
