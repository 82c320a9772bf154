"""The arm goes where the controller says, stands still there, and survives what a controller should never do."""

import math

import numpy as np
import pytest

from simulators.world.world import World

TICK_S = 0.002
BENT = np.array([0.3, -1.4, 1.3, -1.2, -1.5, 0.4])


def trapezoid(start_rad, end_rad, speed_rad_s=1.0, acceleration_rad_s2=3.0):
    """Set-points of a motion, one a tick; the last is the end exactly."""
    way_rad = np.abs(end_rad - start_rad).max()
    ramp_s = speed_rad_s / acceleration_rad_s2
    total_s = way_rad / speed_rad_s + ramp_s
    for t_s in np.arange(0.0, total_s, TICK_S):
        if t_s < ramp_s:
            gone_rad = 0.5 * acceleration_rad_s2 * t_s**2
        elif t_s < total_s - ramp_s:
            gone_rad = speed_rad_s * (t_s - 0.5 * ramp_s)
        else:
            gone_rad = way_rad - 0.5 * acceleration_rad_s2 * (total_s - t_s) ** 2
        yield start_rad + (end_rad - start_rad) * (gone_rad / way_rad)
    yield end_rad


def follow(world: World, goal_rad: np.ndarray) -> float:
    """Drives to the goal; the largest distance to the set-point on the way, rad."""
    worst_rad = 0.0
    for q_rad in trapezoid(world.joints().q_rad, goal_rad):
        world.command(q_rad)
        world.advance(world.time_s + TICK_S)
        worst_rad = max(worst_rad, float(np.abs(world.joints().q_rad - q_rad).max()))
    return worst_rad


def test_smooth_motion_is_followed_and_settles_within_a_tenth_of_a_second(ur5e, no_deviation):
    world = World.from_rig(ur5e(**no_deviation))
    assert follow(world, BENT) < 2e-3  # one millisecond of interpolation at 1 rad/s, and as much again for turns
    world.advance(world.time_s + 0.1)
    assert np.abs(world.joints().q_rad - BENT).max() < 1e-6
    world.advance(world.time_s + 0.4)
    assert np.abs(world.joints().q_rad - BENT).max() < 1e-12
    assert world.stands


def test_standing_torque_is_static_weight_times_lever_arm(ur5e):
    """Stretched out level along -x (UR's all-zero pose): what hangs on joints 2 and 3, by hand."""
    world = World.from_rig(ur5e())
    g = 9.81
    elbow_m, wrist_m = 0.425, 0.425 + 0.3922
    # mass and level distance from joint 2: the frame of a link stands at its far end, so a com of +0.2125 lies inward;
    # what follows the wrist hangs down or sideways from there
    masses = [
        (8.058, elbow_m - 0.2125),
        (2.846, wrist_m - 0.15),
        (1.37, wrist_m),
        (1.3, wrist_m),
        (0.365, wrist_m),
        (0.4, wrist_m),
    ]
    shoulder_nm = sum(mass * g * lever for mass, lever in masses)
    elbow_nm = sum(mass * g * (lever - elbow_m) for mass, lever in masses[1:])
    torque_nm = world.joints().torque_nm
    assert abs(torque_nm[1]) == pytest.approx(shoulder_nm, rel=1e-9)
    assert abs(torque_nm[2]) == pytest.approx(elbow_nm, rel=1e-9)
    assert torque_nm[0] == pytest.approx(0.0, abs=1e-9)


def test_arm_hangs_without_torque_when_there_is_no_gravity(ur5e):
    rig = ur5e()
    rig["arm"]["gravity_m_s2"] = [0, 0, 0]
    np.testing.assert_allclose(World.from_rig(rig, q_rad=BENT).joints().torque_nm, 0.0, atol=1e-12)


def test_large_jumps_do_not_blow_up_and_end_where_they_were_sent(ur5e):
    world = World.from_rig(ur5e())
    rng = np.random.default_rng(3)
    for _ in range(50):
        world.command(rng.uniform(-6.0, 6.0, 6))
        world.advance(world.time_s + 0.02)
        assert np.abs(world.joints().qd_rad_s).max() < 20.0
    world.command(BENT)
    world.advance(world.time_s + 10.0)
    assert np.abs(world.joints().q_rad - BENT).max() < 1e-7


def test_encoder_counts_quantise_what_the_controller_reads(ur5e):
    rig = ur5e()
    rig["arm"]["joint"][1]["encoder_counts"] = 4096
    world = World.from_rig(rig, q_rad=BENT)
    count_rad = 2.0 * math.pi / 4096
    q_rad = world.joints().q_rad
    assert q_rad[1] / count_rad == pytest.approx(round(q_rad[1] / count_rad), abs=1e-9)
    assert 0.0 < abs(q_rad[1] - BENT[1]) <= 0.5 * count_rad
    assert q_rad[0] == pytest.approx(BENT[0], abs=1e-15)


def test_skipping_physics_at_rest_changes_nothing(ur5e, no_deviation):
    """An arm that stands is where it would be had the physics gone on."""
    world = World.from_rig(ur5e(**no_deviation))
    follow(world, BENT)
    while not world.stands:
        world.advance(world.time_s + TICK_S)
    before_rad = world.true_joints_rad()
    body = world._body
    for _ in range(1000):
        body.stands = False
        body.step()
    np.testing.assert_allclose(world.true_joints_rad(), before_rad, atol=1e-12, rtol=0.0)


def test_time_advances_in_whole_milliseconds_whatever_is_asked(ur5e):
    world = World.from_rig(ur5e())
    for until_s in (0.0004, 0.0015, 0.0020, 0.0020, 0.3):
        world.advance(until_s)
    assert world.time_s == pytest.approx(0.3, abs=1e-12)
    world.advance(0.1)  # the past
    assert world.time_s == pytest.approx(0.3, abs=1e-12)
    world.advance(0.3009)
    assert world.time_s == pytest.approx(0.3, abs=1e-12)


def test_masses_and_loads_are_asked_for_anywhere_and_leave_the_arm_where_it_is(ur5e):
    world = World.from_rig(ur5e(), q_rad=BENT)
    held_nm = world.joints().torque_nm
    rest, speed = np.zeros(6), np.array([0.2, -0.3, 0.4, 0.1, 0.5, -0.2])
    assert world.load_nm(BENT, rest) == pytest.approx(held_nm, abs=1e-9)
    there = BENT + 0.3
    mass = world.mass_matrix_kg_m2(there)
    assert mass == pytest.approx(mass.T, abs=1e-12)
    assert np.linalg.eigvalsh(mass).min() > 0.0  # without rotors: the last joint turns a tool of 0.4 kg
    # power of the Coriolis forces is half that of the changing inertia (Siciliano, section 7.2.1)
    step_s = 1e-6
    change = world.mass_matrix_kg_m2(there + step_s * speed) - world.mass_matrix_kg_m2(there - step_s * speed)
    power_w = speed @ (world.load_nm(there, speed) - world.load_nm(there, rest))
    assert power_w == pytest.approx(0.5 * speed @ (change / (2.0 * step_s)) @ speed, rel=1e-6)
    assert np.array_equal(world.joints().q_rad, BENT)
    assert np.array_equal(world.joints().torque_nm, held_nm)
