"""Orientation of the tool: from a 6-D target or from three targets, with its uncertainty, else the reason."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from calibrate.tool_axes.arm_prior import ArmErrors, assumed_prior
from calibrate.tool_axes.tool import calibrate_tool
from calibrate.tool_axes.wrist_fit import TargetRows
from tests.calibrate.tool_axes.drawn_arms import (
    TOOL,
    UR5,
    draw,
    measured,
    nominal,
    turns,
)

POINTS = TOOL + np.array([[0.0, 0.0, 0.0], [0.1, 0.02, 0.0], [0.0, 0.12, 0.03]])
TURN = Rotation.from_rotvec([0.3, -1.1, 0.5])
TURN_NOISE_RAD = 1e-4
EXACT = ArmErrors(0.0, 0.0, 0.0)


def spanned():
    """Frame of the three targets by its definition."""
    x = (POINTS[1] - POINTS[0]) / np.linalg.norm(POINTS[1] - POINTS[0])
    z = np.cross(x, POINTS[2] - POINTS[0])
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def three(errors, seed, points=POINTS):
    rng = np.random.default_rng(seed)
    arm, truth, q = nominal(UR5, errors.links), draw(UR5, errors, rng), turns(4, 5, 6)
    rows = tuple(TargetRows(q, measured(truth, q, rng, p), number=k + 1) for k, p in enumerate(points))
    return calibrate_tool(arm, rows, assumed_prior(arm, errors.zero_sigma_rad))


def six_d(errors, seed):
    rng = np.random.default_rng(seed)
    arm, truth, q = nominal(UR5, errors.links), draw(UR5, errors, rng), turns(4, 5, 6)
    tracker = Rotation.random(random_state=5)  # as in `measured`
    seen = tracker * Rotation.from_matrix(truth.flange(q)[:, :3, :3]) * TURN
    noise = Rotation.from_rotvec(rng.normal(0, TURN_NOISE_RAD, (len(q), 3)))
    rows = TargetRows(q, measured(truth, q, rng), (noise * seen).as_matrix())
    return calibrate_tool(arm, (rows,), assumed_prior(arm, errors.zero_sigma_rad))


def whitened(found, truth):
    turn = found.orientation
    return Rotation.from_matrix(turn.R_flange_tool.T @ truth).as_rotvec() / turn.sigma_rad


def test_three_targets_determine_the_orientation_as_well_as_stated():
    z = [whitened(three(ArmErrors(), seed), spanned()) for seed in range(12)]
    assert 0.75 < np.sqrt(np.mean(np.square(z))) < 1.25


def test_the_last_zero_and_the_flange_s_own_turns_are_in_the_uncertainty_of_the_orientation():
    exact, uncertain = three(EXACT, 1).orientation, three(ArmErrors(), 1).orientation
    assert np.all(exact.sigma_rad < 3e-4)
    assert np.linalg.norm(uncertain.sigma_rad) == pytest.approx(np.sqrt(3e-3**2 + 2 * 1e-3**2), rel=0.05)


def test_a_6d_target_determines_its_own_axes_as_well_as_stated():
    found = [six_d(ArmErrors(), seed) for seed in range(12)]
    z = [whitened(f, TURN.as_matrix()) for f in found]
    assert 0.75 < np.sqrt(np.mean(np.square(z))) < 1.25
    assert np.median([f.noise.turn_rad for f in found]) == pytest.approx(TURN_NOISE_RAD, rel=0.1)


def test_with_an_exact_arm_a_6d_target_is_found_to_the_tracker_s_noise():
    found = six_d(EXACT, 1)
    assert_allclose(found.orientation.rotation_rad, TURN.as_rotvec(), atol=1e-4)
    assert np.all(found.orientation.sigma_rad < TURN_NOISE_RAD)


@pytest.mark.parametrize(
    ("points", "why"),
    [
        (POINTS[:1], "one point has no orientation"),
        (POINTS[:2], "two targets determine the direction of their line"),
        (TOOL + np.outer([0, 1, 2], [0.05, 0.0, 0.0]), "lie on one line within their uncertainty"),
    ],
)
def test_what_does_not_determine_the_orientation_is_the_reason(points, why):
    found = three(ArmErrors(), 1, points)
    assert found.trust == "yes"
    assert found.orientation is None
    assert why in found.orientation_why
