import numpy as np
import pytest

from simulators.ur.controller_kinematics import frame_of, pose_of
from simulators.ur.emulator import arm_controller
from simulators.ur.motion import MoveRefused
from simulators.ur.states import RobotMode, SafetyMode
from simulators.wire import TICK_S
from simulators.world.world import World

START = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])
TURN = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def speeds_rad_s(bench) -> np.ndarray:
    return np.diff(np.array(bench.trace_rad), axis=0) / TICK_S


def test_a_joint_move_arrives_exactly_within_its_limits_and_with_all_joints_together(bench) -> None:
    way = np.array([0.6, -0.3, 0.0, 0.1, 0.0, -0.2])
    bench.arm.move_joints(START + way, 1.0, 3.0)
    took_s = bench.settle()
    assert np.array_equal(bench.world.joints().q_rad, START + way)
    assert took_s == pytest.approx(0.6 / 1.0 + 1.0 / 3.0, abs=3 * TICK_S)
    speeds = speeds_rad_s(bench)
    assert np.abs(speeds).max() == pytest.approx(1.0, rel=1e-6)
    assert np.abs(np.diff(speeds, axis=0)).max() / TICK_S <= 3.0 * 1.001
    shares = (np.array(bench.trace_rad)[:, [0, 1, 3, 5]] - START[[0, 1, 3, 5]]) / way[[0, 1, 3, 5]]
    assert np.ptp(shares, axis=1).max() < 1e-12


def test_a_straight_line_is_straight_and_arrives(bench) -> None:
    start = bench.arm.arm.tool(START.tolist(), bench.arm.T_flange_tool)
    end = (*start[:9], start[9] + 0.1, start[10] - 0.05, start[11] + 0.08)
    bench.arm.move_line(end, 0.25, 1.2)
    bench.settle()
    points = np.array([bench.arm.arm.tool(q.tolist(), bench.arm.T_flange_tool)[9:] for q in bench.trace_rad])
    along = np.array(end[9:]) - start[9:]
    off = np.linalg.norm(np.cross(points - start[9:], along / np.linalg.norm(along)), axis=1)
    assert off.max() < 1e-8
    assert points[-1] == pytest.approx(end[9:], abs=1e-8)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() / TICK_S <= 0.25 * 1.001


def test_a_line_out_of_reach_ends_in_a_protective_stop_at_rest(bench) -> None:
    bench.arm.move_line(frame_of((-1.5, 0.0, 0.3, 0.0, 0.0, 0.0)), 0.25, 1.2)
    bench.settle()
    assert bench.arm.power.safety_mode is SafetyMode.PROTECTIVE_STOP
    assert "over the limit" in bench.arm.stop_reason  # the elbow stretches ever faster on the way out


def test_stopping_brakes_at_the_asked_rate(bench) -> None:
    bench.arm.move_joints(START + TURN, 1.0, 3.0)
    bench.run(1.0)
    bench.arm.stop(4.0)
    assert bench.settle() == pytest.approx(1.0 / 4.0, abs=3 * TICK_S)
    assert bench.trace_rad[-1][0] < 2.0


def test_a_new_move_begins_from_rest(bench) -> None:
    bench.arm.move_joints(START + TURN, 1.0, 3.0)
    bench.run(1.0)
    bench.arm.move_joints(START, 1.0, 3.0)
    bench.settle()
    assert np.array_equal(bench.world.joints().q_rad, START)
    assert np.abs(np.diff(speeds_rad_s(bench), axis=0)).max() / TICK_S <= 12.0 * 1.001


@pytest.mark.parametrize(("gain", "lookahead_s"), [(100.0, 0.2), (300.0, 0.1), (2000.0, 0.03)])
def test_servoing_comes_to_rest_on_its_target_without_overshoot(bench, gain: float, lookahead_s: float) -> None:
    target = START + np.array([0.05, 0, 0, 0, 0, -0.02])
    for _ in range(20):  # streamed, as servoj is
        bench.arm.servo_joints(target, lookahead_s, gain)
        bench.run(1.0)
    trace = np.array(bench.trace_rad)
    assert trace[-1] == pytest.approx(target, abs=1e-9)
    assert trace[:, 0].max() <= target[0] + 1e-9


def test_a_joint_speed_ramps_up_and_runs_into_the_joint_limit_with_a_protective_stop(bench) -> None:
    bench.arm.speed_joints([0, 0, 1.0, 0, 0, 0], 2.0)
    bench.run(0.5)
    assert bench.arm.setpoint.qd_rad_s[2] == pytest.approx(1.0)
    bench.settle()
    upper_rad = 3.1416
    assert upper_rad - 0.01 < bench.trace_rad[-1][2] <= upper_rad + 1e-6
    assert bench.arm.power.safety_mode is SafetyMode.PROTECTIVE_STOP
    assert "joint 3" in bench.arm.stop_reason


def test_a_tool_speed_moves_the_tool_that_way(bench) -> None:
    before = pose_of(bench.arm.arm.tool(START.tolist(), bench.arm.T_flange_tool))
    bench.arm.speed_tool([0.0, 0.05, 0.0, 0.0, 0.0, 0.0], 1.0)
    bench.run(1.0)
    bench.arm.stop_tool(1.0)
    bench.settle()
    after = pose_of(bench.arm.arm.tool(bench.trace_rad[-1].tolist(), bench.arm.T_flange_tool))
    assert after[1] - before[1] == pytest.approx(0.05, abs=2e-4)
    assert np.delete(np.subtract(after, before), 1) == pytest.approx(np.zeros(5), abs=1e-5)


def test_a_protective_stop_holds_until_it_is_unlocked(bench) -> None:
    bench.arm.move_joints(START + 1.0, 1.0, 3.0)
    bench.run(0.5)
    bench.arm.protective_stop()
    bench.settle()
    with pytest.raises(MoveRefused, match="PROTECTIVE_STOP"):
        bench.arm.move_joints(START, 1.0, 3.0)
    assert bench.arm.unlock()
    bench.arm.move_joints(START, 1.0, 3.0)
    bench.settle()
    assert np.array_equal(bench.world.joints().q_rad, START)


def test_an_emergency_stop_needs_release_power_and_brakes(bench) -> None:
    bench.arm.emergency_stop()
    assert not bench.arm.power.power_on()
    bench.arm.emergency_stop(pressed=False)
    assert bench.arm.power.robot_mode is RobotMode.POWER_OFF
    assert bench.arm.power.brake_release()
    seen = []
    while bench.arm.power.robot_mode is not RobotMode.RUNNING:
        assert bench.run_until(lambda: bench.arm.power.robot_mode not in seen, 5.0) < 5.0
        seen.append(bench.arm.power.robot_mode)
    assert seen[1:] == [RobotMode.BOOTING, RobotMode.POWER_ON, RobotMode.IDLE, RobotMode.RUNNING]


def test_the_speed_slider_stretches_a_move(bench) -> None:
    bench.controller.memory.speed_slider = 0.5
    bench.run(0.5)
    bench.arm.move_joints(START + 0.3, 1.0, 3.0)
    assert bench.settle() == pytest.approx(2.0 * (0.3 + 1.0 / 3.0), abs=0.01)


@pytest.mark.parametrize("q", [[0.0] * 5, [np.nan] * 6, [7.0, 0, 0, 0, 0, 0]])
def test_impossible_targets_are_refused(bench, q: list[float]) -> None:
    with pytest.raises(MoveRefused):
        bench.arm.move_joints(q, 1.0, 1.0)


@pytest.mark.parametrize(("speed", "acceleration"), [(0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_impossible_rates_are_refused(bench, speed: float, acceleration: float) -> None:
    with pytest.raises(MoveRefused, match="positive"):
        bench.arm.move_joints(START, speed, acceleration)


def test_over_the_physical_world_a_move_ends_when_the_arm_stands(rig: dict) -> None:
    world = World.from_rig(rig, q_rad=START)
    arm = arm_controller(world, rig)
    arm.move_joints(START + 0.1, 1.0, 3.0)
    while arm.moving:
        t_s = world.time_s
        arm.before_step(t_s)
        world.advance(t_s + TICK_S)
        assert world.time_s < 2.0
    assert world.joints().q_rad == pytest.approx(START + 0.1, abs=1e-5)
    assert np.abs(world.joints().qd_rad_s).max() < 1e-4
