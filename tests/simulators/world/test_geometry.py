"""The true arm stands where its true Denavit-Hartenberg numbers say, computed here with matrices of our own."""

import math

import numpy as np
import pytest

from simulators.world.world import World


def turn(axis: int, angle_rad: float) -> np.ndarray:
    """Homogeneous rotation about x (0), y (1) or z (2)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    pose = np.eye(4)
    pose[i, i] = pose[j, j] = c
    pose[i, j], pose[j, i] = -s, s
    return pose


def shift(x_m: float, z_m: float) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 3], pose[2, 3] = x_m, z_m
    return pose


def product_of_dh(world: World, true_rad: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    for link, q_rad in zip(world.truth.links, true_rad, strict=True):
        pose = pose @ turn(2, q_rad + link.theta_offset_rad) @ shift(link.a_m, link.d_m)
        pose = pose @ turn(0, link.alpha_rad) @ turn(1, link.beta_rad)
    return pose


@pytest.mark.parametrize("seed", range(5))
def test_flange_of_the_true_arm_is_the_product_of_its_true_links(ur5e, no_deviation, seed):
    rig = ur5e(**no_deviation)
    for number, joint in enumerate(rig["arm"]["joint"]):
        joint["theta_offset_rad"] = 0.1 * number
    q_rad = np.random.default_rng(seed).uniform(-3.0, 3.0, 6)
    world = World.from_rig(rig, seed=seed, q_rad=q_rad)
    np.testing.assert_allclose(world.T_base_flange(), product_of_dh(world, world.true_joints_rad()), atol=1e-12)


def test_true_joint_is_reading_plus_zero(ur5e):
    world = World.from_rig(ur5e(joint_zero_max_rad=0.035), q_rad=[0.1, -1.0, 1.0, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(
        world.true_joints_rad(), np.add([0.1, -1.0, 1.0, 0.2, 0.3, 0.4], world.truth.joint_zero_rad), atol=1e-15
    )
    np.testing.assert_allclose(world.joints().q_rad, [0.1, -1.0, 1.0, 0.2, 0.3, 0.4], atol=1e-15)


def test_link_encoders_see_the_true_angle_from_their_own_mounting(ur5e):
    world = World.from_rig(ur5e(joint_zero_max_rad=0.035))
    offset_rad = world.link_encoders_rad() - world.true_joints_rad()
    np.testing.assert_allclose(offset_rad, world.truth.link_encoder_offset_rad, atol=1e-15)
    assert np.ptp(offset_rad) > 0.1


def test_beam_leaves_the_flange_where_the_laser_truly_sits(ur5e, no_deviation):
    world = World.from_rig(ur5e(**no_deviation), q_rad=[0.3, -1.2, 1.1, 0.4, -0.7, 0.9])
    pose, beam, truth = world.T_base_flange(), world.beam(), world.truth
    np.testing.assert_allclose(beam[:3], pose[:3, :3] @ truth.laser_origin_m + pose[:3, 3], atol=1e-12)
    np.testing.assert_allclose(beam[3:], pose[:3, :3] @ truth.laser_direction, atol=1e-12)


def test_flange_frame_of_the_rig_comes_after_the_last_link(ur5e):
    rig = ur5e()
    without = World.from_rig(rig).T_base_flange()
    rig["arm"]["flange"] = {"origin_m": [0.01, 0.02, 0.03], "rotation_rad": [0.0, 0.0, 0.5]}
    extra = turn(2, 0.5)
    extra[:3, 3] = [0.01, 0.02, 0.03]
    np.testing.assert_allclose(World.from_rig(rig).T_base_flange(), without @ extra, atol=1e-12)


def test_a_frame_that_is_turned_by_no_more_than_rounding_is_built(ur5e):
    """Corrections of a model leave such turns: the axis that MuJoCo is given has length 1 all the same."""
    rig = ur5e()
    turned = [1e-16, -2e-17, 0.0]
    rig["arm"]["flange"] = {"origin_m": [0.0, 0.0, 0.0], "rotation_rad": turned}
    assert World.from_rig(rig, seed=1).truth.flange.rotation_rad == pytest.approx(turned)
