"""Arms with errors of their own: the target is in its interval as often as stated, and the interval is not too wide."""

import numpy as np
import pytest

from calibrate.tool_axes.arm_prior import ArmErrors, assumed_prior
from calibrate.tool_axes.tool import calibrate_tool
from calibrate.tool_axes.wrist_fit import TargetRows
from tests.calibrate.tool_axes.drawn_arms import (
    OBLIQUE,
    UR5,
    ZEROS_AND_LENGTHS,
    ZEROS_ONLY,
    draw,
    found_on,
    measured,
    nominal,
    turns,
    whitened_errors,
)

WITHIN_95 = 1.96


def test_the_error_of_arms_of_the_prior_is_as_large_as_stated():  # UR5 and the rest: below
    z = whitened_errors(OBLIQUE, ArmErrors(), (5, 6), range(40))
    assert len(z) >= 38
    assert np.mean(np.abs(z) < WITHIN_95) >= 0.90  # of 120; a share of 0.95 falls below once in 120 times
    assert 0.8 < np.sqrt(np.mean(z**2)) < 1.2


@pytest.mark.endure  # 200 arms each
@pytest.mark.parametrize("joints", [(5, 6), (3, 4, 5, 6)])
@pytest.mark.parametrize("errors", [ZEROS_ONLY, ZEROS_AND_LENGTHS, ArmErrors()], ids=["zeros", "lengths", "all"])
@pytest.mark.parametrize("table", [UR5, OBLIQUE], ids=["ur5", "oblique"])
def test_93_of_100_components_of_200_arms_are_within_95_percent(table, errors, joints):
    z = whitened_errors(table, errors, joints, range(200))
    assert len(z) >= 190
    assert 0.93 <= np.mean(np.abs(z) < WITHIN_95) <= 0.985
    assert 0.85 < np.sqrt(np.mean(z**2)) < 1.15


@pytest.mark.parametrize("table", [UR5, pytest.param(OBLIQUE, marks=pytest.mark.endure)], ids=["ur5", "oblique"])
def test_without_options_arms_with_zeros_of_3_mrad_are_covered(table):
    z = whitened_errors(table, ZEROS_ONLY, (4, 5, 6), range(20), assumed=ArmErrors())
    assert np.mean(np.abs(z) < WITHIN_95) >= 0.95


def test_zeros_of_the_joints_before_the_wrist_do_not_matter():
    """Only the last zero does: it turns the target about the last axis."""
    found = found_on(UR5, ZEROS_ONLY, (4, 5, 6), 1)
    expected = ZEROS_ONLY.zero_sigma_rad * np.hypot(0.035, 0.02)
    target = found.targets[0]
    assert np.linalg.norm(target.arm_sigma_m) == pytest.approx(expected, rel=0.02)
    assert np.all(target.instrument_sigma_m < 2e-5)


def test_an_arm_far_beyond_its_prior_is_noticed_and_its_uncertainty_widened():
    exact = ArmErrors(zero_sigma_rad=1e-4, length_sigma_m=2e-5, angle_sigma_rad=5e-5)
    found = [found_on(OBLIQUE, ArmErrors(3e-4, 6e-5, 1.5e-4), (2, 3, 4, 5, 6), seed, exact) for seed in range(12)]
    answered = [f for f in found if f.why is None]
    careful = [f for f in answered if f.trust == "with care"]
    assert len(careful) >= 6
    assert all(f.widened > 1.5 for f in careful)
    assert all("times the assumed uncertainty" in f.cautions[0] for f in careful)
    assert np.median([f.widened for f in answered]) == pytest.approx(3.0, rel=0.5)


@pytest.mark.parametrize("seed", range(4))
def test_an_arm_of_another_table_gets_no_number(seed):
    other = found_on(UR5, ArmErrors(0.0, 0.0, 0.05), (4, 5, 6), seed, assumed=ArmErrors())
    assert other.trust == "no"
    assert other.targets[0].point_m is None
    assert "check the arm's table and the joint signs" in other.why


@pytest.mark.parametrize("joint", [3, 4, 5, 6])
def test_a_joint_that_counts_the_other_way_is_noticed_in_the_rows_that_check(joint):
    rng = np.random.default_rng(2)
    arm, q = nominal(UR5, ArmErrors().links), turns(3, 4, 5, 6)
    position_m = measured(draw(UR5, ArmErrors(), rng), q * np.where(np.arange(6) == joint - 1, -1.0, 1.0), rng)
    found = calibrate_tool(arm, (TargetRows(q, position_m),), assumed_prior(arm))
    assert found.trust == "no"
    assert "the rows in which other joints moved" in found.why or "the last two axes" in found.why


def test_a_recording_of_the_last_two_joints_alone_is_trusted_with_care():
    """It looks the same from an arm whose last joint counts the other way."""
    found = found_on(UR5, ArmErrors(), (5, 6), 1)
    assert found.trust == "with care"
    assert found.cautions == (
        "only the last two joints turn, so a wrong sign of one of them would not be noticed; turn a joint before them, "
        "too",
    )
    assert found_on(UR5, ArmErrors(), (4, 5, 6), 1).trust == "yes"
