"""Motions that the controller makes itself are gone through first: range, boxes, slow areas."""

import numpy as np
import pytest

from acquisition.errors import RefusedMotionError
from acquisition.motion.cell import Box, Cell, SlowArea
from acquisition.motion.under_way import GatedArm
from tests.acquisition.motion.conftest import ur5e

ARM = ur5e()
HOME_RAD = np.array([0.3, -1.4, 1.6, -0.5, 0.5, 0.0])
ALL = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


class Controller:
    name = "robot"

    def __init__(self) -> None:
        self.moves: list[tuple[np.ndarray, float, float]] = []

    def move_joints(self, q_rad, speed_rad_s, acceleration_rad_s2) -> None:
        self.moves.append((q_rad, speed_rad_s, acceleration_rad_s2))


def moved(cell: Cell, target_rad: np.ndarray) -> Controller:
    controller = Controller()
    GatedArm(controller, ARM, cell, lambda: HOME_RAD).move_joints(target_rad, 1.0, 3.0)
    return controller


def test_in_an_open_cell_the_motion_goes_through_as_it_is() -> None:
    target_rad = HOME_RAD + 0.3
    ((q_rad, speed, acceleration),) = moved(Cell(), target_rad).moves
    np.testing.assert_array_equal(q_rad, target_rad)
    assert (speed, acceleration) == (1.0, 3.0)
    assert moved(Cell(), HOME_RAD).moves  # to where it stands


def test_a_box_on_the_way_is_found_also_when_the_end_is_free() -> None:
    target_rad = HOME_RAD + np.array([2.0, 0, 0, 0, 0, 0])
    middle_m = ARM.frames((HOME_RAD + np.array([1.0, 0, 0, 0, 0, 0]))[None])[0, -1, :3, 3]
    post = Box("post", tuple(middle_m - 0.02), tuple(middle_m + 0.02))
    with pytest.raises(RefusedMotionError, match="within 0 mm of the keep-out box 'post'"):
        moved(Cell(keep_out=(post,)), target_rad)


def test_an_arm_that_stands_too_near_a_box_may_leave_it_but_not_come_nearer() -> None:
    flange_m = ARM.frames(HOME_RAD[None])[0, -1, :3, 3]
    turn_rad = np.array([0.5, 0, 0, 0, 0, 0])
    away_m = ARM.frames((HOME_RAD + turn_rad)[None])[0, -1, :3, 3] - flange_m
    post_m = flange_m - 0.08 * away_m / np.linalg.norm(away_m)  # behind the arm as it turns away
    post = Box("post", tuple(post_m - 0.04), tuple(post_m + 0.04))
    assert post.distance_m(flange_m) < Cell().clearance_m
    assert moved(Cell(keep_out=(post,)), HOME_RAD + turn_rad).moves
    with pytest.raises(RefusedMotionError, match="keep-out box 'post'"):
        moved(Cell(keep_out=(post,)), HOME_RAD - turn_rad)


def test_the_speed_is_capped_where_the_tool_has_to_be_slow() -> None:
    target_rad = HOME_RAD + np.array([0.5, 0, 0, 0, 0, 0])
    flange_m = ARM.frames(HOME_RAD[None])[0, -1, :3, 3]
    wrists_m = ARM.frames(HOME_RAD[None])[0, -2:, :3, 3]
    reach_m = np.hypot(wrists_m[:, 0], wrists_m[:, 1]).max()
    ((_, speed, _),) = moved(Cell(slow=(SlowArea(Box("fixture", *ALL), 0.05),)), target_rad).moves
    assert speed == pytest.approx(0.05 / reach_m, rel=1e-3)
    far = SlowArea(Box("far", tuple(flange_m + 5.0), tuple(flange_m + 6.0)), 0.05)
    assert moved(Cell(slow=(far,)), target_rad).moves[0][1] == 1.0


def test_out_of_range_is_refused_with_its_joint() -> None:
    with pytest.raises(RefusedMotionError, match=r"joint 3 at 206\.3° would leave its range"):
        moved(Cell(), HOME_RAD + np.array([0, 0, 2.0, 0, 0, 0]))
