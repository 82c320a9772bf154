"""Forces, torques and contact that the controller reports."""

import math

import numpy as np
import pytest

from simulators.ur.controller_kinematics import IDENTITY, compose, frame_of, invert, rotate
from simulators.ur.dynamics import Carried, Dynamics, Obstacle
from simulators.ur.emulator import Safety
from simulators.ur.registers import Installation
from simulators.ur.states import RuntimeState, SafetyMode
from tests.simulators.ur.conftest import START_RAD
from tests.simulators.ur.test_control_script import PROGRAM, Client

CARRIED = Carried(2.0, (0.01, 0.02, 0.05))
STATED = Installation(2.0, (0.01, 0.02, 0.05))
TOOL = frame_of((0.0, 0.0, 0.2, 0.3, 0.0, 0.0))
WEIGHT_N = 2.0 * 9.81
CYCLE_M = 0.1 * 0.002 + 1e-6  # at 0.1 m/s; the readings of a line are rounded below a micrometre


@pytest.fixture
def dynamics(bench) -> Dynamics:
    return Dynamics(bench.world, bench.arm.arm, CARRIED)


@pytest.fixture
def flange(bench):
    return bench.arm.arm.forward(START_RAD.tolist())[0]


def test_a_stated_payload_leaves_no_force_at_the_tool(dynamics, flange) -> None:
    assert dynamics.tool_wrench(flange, compose(flange, TOOL), STATED) == pytest.approx([0.0] * 6, abs=1e-12)
    assert math.hypot(*dynamics.raw_wrench(flange)[:3]) == pytest.approx(WEIGHT_N)


def test_what_was_not_stated_weighs_on_the_tool_point(dynamics, flange) -> None:
    T_base_tool = compose(flange, TOOL)
    wrench = dynamics.tool_wrench(flange, T_base_tool, Installation())
    assert wrench[:3] == pytest.approx([0.0, 0.0, -WEIGHT_N])
    com_m = np.add(rotate(flange, CARRIED.com_m), flange[9:])
    assert wrench[3:] == pytest.approx(np.cross(com_m - T_base_tool[9:], [0.0, 0.0, -WEIGHT_N]))


def test_zeroing_holds_in_the_axes_of_the_sensor(dynamics, flange) -> None:
    dynamics.zero_sensor(flange, Installation())
    assert dynamics.tool_wrench(flange, flange, Installation()) == pytest.approx([0.0] * 6, abs=1e-12)
    over = compose(flange, frame_of((0.0, 0.0, 0.0, math.pi, 0.0, 0.0)))
    turned = dynamics.tool_wrench(over, over, Installation())
    then = rotate(invert(flange), (0.0, 0.0, -WEIGHT_N))
    assert turned[:3] == pytest.approx(np.subtract([0.0, 0.0, -WEIGHT_N], rotate(over, then)))


def test_outer_torques_hold_up_only_what_was_not_stated(dynamics, bench, flange) -> None:
    joints, rest = bench.world.joints(), np.zeros(6)
    assert dynamics.outer_torque_nm(joints, rest, STATED) == pytest.approx(rest, abs=1e-12)
    J, _ = bench.arm.arm.jacobian(START_RAD.tolist(), IDENTITY)
    wrench = dynamics.tool_wrench(flange, flange, Installation())
    assert dynamics.outer_torque_nm(joints, rest, Installation()) == pytest.approx(-J.T @ wrench)
    moving = dynamics.outer_torque_nm(joints, np.ones(6), STATED)
    assert moving == pytest.approx(-(np.arange(6.0) + 1.0))  # the inertia of a world that needs no torque for it


def test_the_jacobian_changes_along_the_motion(dynamics, bench) -> None:
    qd_rad_s = np.array([0.3, -0.2, 0.5, 0.1, -0.4, 0.2])
    step_s = 1e-4  # central difference over another step: both err by the third derivative times its square
    after, before = (
        bench.arm.arm.jacobian((START_RAD + sign * step_s * qd_rad_s).tolist(), TOOL)[0] for sign in (1, -1)
    )
    assert dynamics.jacobian_rate(START_RAD, qd_rad_s, TOOL) == pytest.approx((after - before) / (2 * step_s), abs=1e-7)
    assert dynamics.coriolis_nm(START_RAD, qd_rad_s) == pytest.approx(qd_rad_s**2)


# --- contact, through the commands of the control script


@pytest.fixture
def start_m(bench) -> float:
    return bench.arm.arm.forward(START_RAD.tolist())[0][11]


def test_a_move_until_contact_ends_where_the_tool_touched_first(bench, start_m: float) -> None:
    bench.arm.dynamics.obstacle = Obstacle((0.0, 0.0, start_m - 0.03))
    client = Client(bench)
    took_s = client.do(51, 0, 0, -0.1, 0, 0, 0, *([0.0] * 6), 1.2)
    here_m = bench.arm.arm.forward(bench.world.joints().q_rad.tolist())[0][11]
    assert start_m - 0.03 <= here_m <= start_m - 0.03 + CYCLE_M  # in the last cycle before the contact
    assert took_s < 2.0
    assert bench.controller.runner.state is RuntimeState.PLAYING


def test_without_a_contact_the_program_ends_at_a_limit(bench) -> None:
    client = Client(bench)
    client.send(51, 0, 0, 0.25, 0, 0, 0, *([0.0] * 6), 1.2)
    bench.run_until(lambda: bench.controller.runner.state is RuntimeState.STOPPED, 20.0)
    assert bench.controller.runner.state is RuntimeState.STOPPED
    assert bench.arm.power.safety_mode is SafetyMode.PROTECTIVE_STOP


def test_only_a_push_in_the_asked_direction_is_a_contact(bench, start_m: float) -> None:
    bench.arm.dynamics.obstacle = Obstacle((0.0, 0.0, start_m + 0.01))
    touches = bench.arm.dynamics.touches
    assert touches(IDENTITY, (0.0, 0.0, 0.0))
    assert touches(IDENTITY, (0.0, 0.0, -1.0))
    assert not touches(IDENTITY, (0.0, 0.0, 1.0))
    assert not touches(frame_of((0.0, 0.0, 0.0, 0.0, 0.0, 0.0)), (1.0, 0.0, 0.0))


def test_contact_detection_ends_an_asynchronous_move(bench, start_m: float) -> None:
    bench.arm.dynamics.obstacle = Obstacle((0.0, 0.0, start_m - 0.03))
    client = Client(bench)
    client.do(62)
    low = (*bench.arm.arm.forward(START_RAD.tolist())[0][9:11], start_m - 0.1)
    tool = [*low, *bench.controller.rtde.readout.tool_pose[3:]]
    client.do(3, *tool, 0.1, 1.2, integer=1)
    client.do(64)
    assert client.memory.outputs.ints[1] == 0
    bench.run_until(lambda: client.state == 2, 10.0)  # the script says so when it is back at the contact
    here_m = bench.arm.arm.forward(bench.world.joints().q_rad.tolist())[0][11]
    assert start_m - 0.03 <= here_m <= start_m - 0.03 + CYCLE_M
    bench.run(0.004)
    client.do(64)
    assert client.memory.outputs.ints[1] > 0


# --- dynamics that scripts from PolyScope 5.23 on hold


def test_matrices_stand_in_the_registers_of_the_script(bench) -> None:
    asks = "\n        mass_matrix = get_mass_matrix()"
    client = Client(bench, path="\n        # nothing" + asks)
    client.send(67)
    bench.run(0.004)
    registers = client.memory.outputs.doubles
    matrix = np.array(registers[:24] + registers[36:48]).reshape(6, 6).T
    assert np.array_equal(matrix, np.diag(np.arange(6.0) + 1.0))
    client.send(70)
    bench.run(0.004)
    matrix = np.array(registers[:24] + registers[36:48]).reshape(6, 6).T
    assert matrix == pytest.approx(bench.arm.arm.jacobian(START_RAD.tolist(), IDENTITY)[0])


def test_an_earlier_script_leaves_the_registers_as_they_are(bench) -> None:
    assert "get_mass_matrix" not in PROGRAM
    client = Client(bench)
    client.memory.outputs.doubles[:6] = [7.0] * 6
    for command in (66, 67, 68, 69, 70, 71):
        client.send(command)
        bench.run(0.004)
    assert client.results(6) == [7.0] * 6
    assert client.state == 1


# --- what a person at the robot may change


def test_an_obstacle_is_a_point_and_a_direction(bench) -> None:
    verbs = Safety(bench.controller)
    verbs.obstacle([0.1, 0.2, 0.3], [0.0, 3.0, 4.0])
    assert bench.arm.dynamics.obstacle == Obstacle((0.1, 0.2, 0.3), (0.0, 0.6, 0.8))
    for point_m, normal in (([0.0, 0.0], [0.0, 0.0, 1.0]), ([0.0] * 3, [0.0] * 3), ([math.nan] * 3, [0.0, 0.0, 1.0])):
        with pytest.raises(ValueError, match="three finite numbers"):
            verbs.obstacle(point_m, normal)


@pytest.mark.parametrize("version", ["5.12", "5.12.0.x", "", "5.12.0.-1"])
def test_a_version_has_four_numbers(bench, version: str) -> None:
    with pytest.raises(ValueError, match="four numbers"):
        Safety(bench.controller).polyscope(version)
