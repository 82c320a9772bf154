"""Frames, deflections and overturning moments of the fast path against MuJoCo's own statics."""

from collections.abc import Callable

import numpy as np
import pytest

from simulators.arm.kinematics import Arm, forward
from simulators.conceal.readings import balanced
from simulators.defects import Scene
from simulators.defects.base import SoftPedestal
from simulators.defects.drive import SoftJoint
from tests.simulators.conceal import mujoco_arm

SceneOf = Callable[..., Scene]


def test_the_flange_is_where_mujoco_has_it(arm: Arm, poses: np.ndarray) -> None:
    ours = forward(arm, poses).flange
    for row, joint_rad in enumerate(poses):
        theirs = mujoco_arm.settled_flange(mujoco_arm.build(arm, joint_rad, {}), seconds=0.0)
        assert ours[row] == pytest.approx(theirs, abs=1e-12)


@pytest.mark.parametrize("joint", [2, 3, 5])
def test_a_soft_joint_deflects_as_a_spring_in_mujoco(arm: Arm, poses: np.ndarray, scene: SceneOf, joint: int) -> None:
    stiffness_nm_rad = 800.0  # soft enough that the deflected pose carries another torque than the wanted one
    pose = poses[:1]
    theirs = mujoco_arm.settled_flange(mujoco_arm.build(arm, pose[0], {joint: stiffness_nm_rad}), seconds=6.0)
    ours = balanced(arm, scene(pose), [SoftJoint(joint, 1.0 / stiffness_nm_rad)], pose)
    assert ours.settled
    assert ours.frames.flange[0] == pytest.approx(theirs, abs=2e-8)
    stiff = forward(arm, pose).flange[0]
    assert np.abs(ours.frames.flange[0] - stiff).max() > 1e-4


def test_a_soft_pedestal_leans_as_in_mujoco(arm: Arm, poses: np.ndarray, scene: SceneOf) -> None:
    stiffness_nm_rad = 2e5
    pose = poses[1:2]
    theirs = mujoco_arm.settled_flange(mujoco_arm.build(arm, pose[0], {}, stiffness_nm_rad), seconds=3.0)
    ours = balanced(arm, scene(pose), [SoftPedestal(1.0 / stiffness_nm_rad)], pose)
    moved_m = np.abs(ours.frames.flange[0] - forward(arm, pose).flange[0]).max()
    assert moved_m > 2e-5
    assert ours.frames.flange[0] == pytest.approx(theirs, abs=1e-3 * moved_m)
