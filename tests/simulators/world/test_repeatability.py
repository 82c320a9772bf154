"""How far the arm stands off its readings: a new amount after each motion, none while it stands."""

import numpy as np

from simulators.world.body import SEATING_S, Repeatability
from simulators.world.world import World

SIGMA_RAD = 3e-6


def stand_off_rad(world: World) -> np.ndarray:
    return world.true_joints_rad() - world.joints().q_rad - np.array(world.truth.joint_zero_rad)


def test_stand_off_after_many_motions_has_the_stated_sigma(ur5e):
    world = World.from_rig(ur5e(joint_repeatability_rad=SIGMA_RAD, joint_zero_max_rad=0.01))
    offs_rad = []
    for turn in range(150):
        world.command(np.full(6, 0.01 * (turn % 2)))
        world.advance(world.time_s + 0.3)
        assert world.stands
        offs_rad.append(stand_off_rad(world))
    offs_rad = np.array(offs_rad)
    n = offs_rad.size
    assert abs(offs_rad.std() / SIGMA_RAD - 1.0) < 4.0 / np.sqrt(2 * n)  # 4 sigma of a standard deviation
    assert abs(offs_rad.mean()) < 4.0 * SIGMA_RAD / np.sqrt(n)
    steps = np.corrcoef(offs_rad[:-1].ravel(), offs_rad[1:].ravel())[0, 1]
    assert abs(steps) < 4.0 / np.sqrt(n)


def test_standing_arm_does_not_creep(ur5e):
    world = World.from_rig(ur5e(joint_repeatability_rad=SIGMA_RAD))
    world.command(np.full(6, 0.01))
    world.advance(0.3)
    before_rad = world.true_joints_rad()
    world.command(np.full(6, 0.01))  # the same set-point again is no motion
    world.advance(5.0)
    np.testing.assert_array_equal(world.true_joints_rad(), before_rad)


def test_offset_is_taken_up_without_a_step_and_once_a_motion():
    seating = Repeatability(SIGMA_RAD, 6, np.random.default_rng(5))
    before_rad = seating.offset_rad.copy()
    steps_rad = []
    for _ in range(400):  # a long motion: the set-point changes all the time
        seating.setpoint_changed()
        seating.step(moving=True)
        steps_rad.append(seating.offset_rad - before_rad)
        before_rad = seating.offset_rad.copy()
    steps_rad = np.abs(steps_rad)
    curve = round(SEATING_S / 0.001)
    assert steps_rad.max() < 6 * SIGMA_RAD * 2.0 / curve  # steepest part of the curve: 1.5 / its length
    assert (steps_rad[curve:] == 0.0).all()
    assert not seating.seated


def test_every_motion_after_standing_draws_anew_and_pauses_in_a_motion_do_not():
    seating = Repeatability(SIGMA_RAD, 6, np.random.default_rng(5))

    def move_then_wait(wait_steps: int) -> np.ndarray:
        seating.setpoint_changed()
        seating.step(moving=True)
        for _ in range(wait_steps):
            seating.step(moving=False)
        return seating._to_rad.copy()

    first = move_then_wait(100)
    second = move_then_wait(10)
    third = move_then_wait(100)
    assert (first != second).all()
    np.testing.assert_array_equal(second, third)
