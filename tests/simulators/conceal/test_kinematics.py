"""Three notations, one arm; slopes; poses that are reached."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simulators.arm.drawing import Row, as_local_poe, fixed_parts, turning_com_m
from simulators.arm.kinematics import Arm, forward, inverse, jacobian, reach_pose, within_limits
from simulators.conceal.rigs import ARM_CMM, IRB120, LARGE, UR5

UR5_DH = replace(  # the maker's own table, standard notation
    UR5,
    model="dh",
    rows=(
        Row(0.0, math.pi / 2, 0.1625),
        Row(-0.425, 0.0, 0.0),
        Row(-0.3922, 0.0, 0.0),
        Row(0.0, math.pi / 2, 0.1333),
        Row(0.0, -math.pi / 2, 0.0997),
        Row(0.0, 0.0, 0.0996),
    ),
    com_m=(  # as the maker gives them, in the frames of that table
        (0.0, -0.02561, 0.00193),
        (0.2125, 0.0, 0.11336),
        (0.15, 0.0, 0.0265),
        (0.0, -0.0018, 0.01634),
        (0.0, 0.0018, 0.01634),
        (0.0, 0.0, -0.001159),
    ),
)


def flange(parts: np.ndarray, q_rad: np.ndarray, arm: Arm) -> np.ndarray:
    return forward(replace(arm, fixed=parts), q_rad).flange


def test_craigs_and_the_standard_notation_give_one_arm(arm: Arm, poses: np.ndarray) -> None:
    craig, standard = fixed_parts(UR5), fixed_parts(UR5_DH)
    np.testing.assert_allclose(flange(craig, poses, arm), flange(standard, poses, arm), atol=1e-12)


def test_centres_of_mass_stay_where_they_are_in_the_other_notation(arm: Arm, poses: np.ndarray) -> None:
    places = []
    for drawing in (UR5, UR5_DH):
        frames = forward(replace(arm, fixed=fixed_parts(drawing)), poses)
        com_m = turning_com_m(drawing)
        places.append(np.einsum("rnij,nj->rni", frames.turning[..., :3, :3], com_m) + frames.turning[..., :3, 3])
    np.testing.assert_allclose(places[0], places[1], atol=1e-12)


@pytest.mark.parametrize("drawing", [IRB120, UR5, LARGE, ARM_CMM], ids=lambda drawing: drawing.name)
def test_local_poe_says_the_same(drawing, arm: Arm, poses: np.ndarray) -> None:
    other = fixed_parts(as_local_poe(drawing))
    np.testing.assert_allclose(flange(other, poses, arm), flange(fixed_parts(drawing), poses, arm), atol=1e-12)


def test_the_reference_arm_stands_as_its_paper_says() -> None:
    """L1 + L3 + L5 up and L2 + L4 + ... out: the product of the paper's matrices at zero."""
    product = np.eye(4)
    cycle_back, cycle_on = np.roll(np.eye(3), 1, axis=1), np.roll(np.eye(3), -1, axis=1)
    for rotation, origin_mm in (
        (np.eye(3), (0, 0, 0)),
        (cycle_back, (74, 0, 176)),
        (cycle_on, (0, 0, 0)),
        (cycle_back, (69.5, 0, 585)),
        (cycle_on, (0, 0, 0)),
        (cycle_back, (0, 0, 475)),
        (np.eye(3), (146.5, 0, 76)),
    ):
        part = np.eye(4)
        part[:3, :3], part[:3, 3] = rotation, np.array(origin_mm) / 1000.0
        product = product @ part
    ours = np.linalg.multi_dot(list(fixed_parts(ARM_CMM)))
    np.testing.assert_allclose(ours, product, atol=1e-12)


def test_slopes_match_differences(arm: Arm, poses: np.ndarray) -> None:
    step_rad = 1e-6
    frames = forward(arm, poses)
    slope = jacobian(frames, frames.flange[:, :3, 3])
    for joint in range(6):
        there = forward(arm, poses + step_rad * np.eye(6)[joint]).flange
        back = forward(arm, poses - step_rad * np.eye(6)[joint]).flange
        np.testing.assert_allclose(slope[:, :3, joint], (there - back)[:, :3, 3] / (2.0 * step_rad), atol=1e-9)
        spin = (there @ inverse(back))[:, [2, 0, 1], [1, 2, 0]] / (2.0 * step_rad)
        np.testing.assert_allclose(slope[:, 3:, joint], spin, atol=1e-6)


def test_a_pose_of_the_arm_is_reached_from_nearby(arm: Arm, poses: np.ndarray) -> None:
    wanted = forward(arm, poses).flange
    found_rad, arrived = reach_pose(arm, wanted, poses + 0.1)
    assert arrived.all()
    np.testing.assert_allclose(forward(arm, found_rad).flange, wanted, atol=1e-10)


def test_readings_are_turned_into_the_limits(arm: Arm, poses: np.ndarray) -> None:
    reading_rad, inside = within_limits(arm, poses + 2.0 * np.pi)
    assert inside.all()
    np.testing.assert_allclose(reading_rad, poses, atol=1e-12)
    _, inside = within_limits(arm, poses + np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0]))
    assert not inside.all()
