"""The commands of ur_rtde's control script: number, inputs, effect, results.

Without effect on the emulated world, but answered as the script does: force mode, free-drive, teach mode, an external
force sensor, direct torque. `getTargetWaypoint` gives the set-point's tool pose. Contact is that of the tool point with
the obstacle of simulators/ur/dynamics.py. Commands 67 to 71 are answered only where the script holds their functions,
which ur_rtde uploads from PolyScope 5.23 on; before that they do nothing, as in the script.
Source of numbers and registers: the control script of ur_rtde 1.6.5, `process_cmd`.
"""

from collections.abc import Callable
from typing import Protocol

from simulators.ur.controller_kinematics import IDENTITY, compose, frame_of, pose_of, rotate
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.moves import Floats, Leg
from simulators.ur.program import Wait
from simulators.ur.registers import Memory
from simulators.wire import TICK_S


class Script(Protocol):
    """What a command may read and do."""

    arm: ArmController
    memory: Memory
    tool_speed_mode: bool
    has_dynamics: bool

    def number(self, index: int) -> float: ...
    def numbers(self, first: int, count: int = 6) -> list[float]: ...
    def integer(self, index: int) -> int: ...
    def answer(self, values: "list[float] | tuple[float, ...]") -> None: ...
    def answer_integer(self, value: int) -> None: ...
    def answer_matrix(self, matrix: Floats) -> None: ...
    def contact_steps(self, direction: "list[float]") -> int: ...
    def back_to_contact(self, steps: int) -> Wait: ...
    def watch_contact(self, direction: "list[float] | None") -> None: ...
    @property
    def contact_step_back(self) -> int: ...
    def begin(self, legs: list[Leg], is_async: bool) -> Wait | None: ...
    def begin_path(self, is_async: bool) -> Wait | None: ...
    def stop(self, is_tool: bool, deceleration: float, is_async: bool) -> Wait | None: ...
    def stands(self) -> bool: ...
    def end_async(self) -> None: ...
    def arm_watchdog(self, min_frequency_hz: float) -> None: ...


Command = Callable[[Script], Wait | None]

# --- motion


def move_joints(s: Script) -> Wait | None:
    return s.begin([s.arm.joint_leg(s.numbers(0), s.number(6), s.number(7))], s.integer(1) == 1)


def move_joints_to_pose(s: Script) -> Wait | None:
    q_rad = s.arm.inverse(frame_of(s.numbers(0)))
    return s.begin([s.arm.joint_leg(q_rad, s.number(6), s.number(7))], s.integer(1) == 1)


def move_line(s: Script) -> Wait | None:
    return s.begin([s.arm.line_leg(frame_of(s.numbers(0)), s.number(6), s.number(7))], s.integer(1) == 1)


def move_line_to_joints(s: Script) -> Wait | None:
    T_base_tool = s.arm.arm.tool(s.numbers(0), s.arm.T_flange_tool)
    return s.begin([s.arm.line_leg(T_base_tool, s.number(6), s.number(7))], s.integer(1) == 1)


def move_path(s: Script) -> Wait | None:
    return s.begin_path(s.integer(1) == 1)


def servo_joints(s: Script) -> None:
    s.end_async()
    s.arm.servo_joints(s.numbers(0), s.number(9), s.number(10))


def servo_line(s: Script) -> None:
    s.end_async()
    s.arm.servo_joints(s.arm.inverse(frame_of(s.numbers(0))), s.number(9), s.number(10))


def servo_circle(s: Script) -> None:
    """servoc, on a straight way: circles are not emulated."""
    s.end_async()
    s.arm.servo_joints(s.arm.inverse(frame_of(s.numbers(0))), 0.1, 300.0)


def speed_joints(s: Script) -> None:
    s.end_async()
    s.tool_speed_mode = False
    s.arm.speed_joints(s.numbers(0), s.number(6))


def speed_line(s: Script) -> None:
    s.end_async()
    s.tool_speed_mode = True
    s.arm.speed_tool(s.numbers(0), s.number(6))


def speed_stop(s: Script) -> Wait | None:
    return s.stop(s.tool_speed_mode, s.number(0), is_async=False)


def servo_stop(s: Script) -> Wait | None:
    return s.stop(is_tool=False, deceleration=s.number(0), is_async=False)


def stop_line(s: Script) -> Wait | None:
    return s.stop(is_tool=True, deceleration=s.number(0), is_async=s.integer(1) == 1)


def stop_joints(s: Script) -> Wait | None:
    return s.stop(is_tool=False, deceleration=s.number(0), is_async=s.integer(1) == 1)


def jog_start(s: Script) -> None:
    """d6 names the frame of the speed: 0 base, 1 tool, 2 the one in d8 to d13."""
    frames = {1: s.arm.arm.tool(s.arm.joints.q_rad.tolist(), s.arm.T_flange_tool), 2: frame_of(s.numbers(8))}
    frame = frames.get(int(s.number(6)), IDENTITY)
    s.end_async()
    s.arm.speed_tool([*rotate(frame, s.numbers(0, 3)), *rotate(frame, s.numbers(3, 3))], s.number(7))


def jog_stop(s: Script) -> Wait | None:
    return s.stop(is_tool=True, deceleration=1.2, is_async=False)


def move_until_contact(s: Script) -> Wait:
    """Tool speed until the tool touches the obstacle, then back to where it touched first.

    Without an obstacle in its way the arm goes on to a limit, where a protective stop ends the program.
    """
    speed, direction, acceleration = s.numbers(0), s.numbers(6, 3), s.number(12)
    s.end_async()
    rest: list[Wait] = []

    def done() -> bool:
        if not rest:
            steps = s.contact_steps(direction)
            if not steps:
                s.arm.speed_tool(speed, acceleration)
                return False
            rest.append(s.back_to_contact(steps))
        return rest[0]()

    return done


def tool_contact(s: Script) -> None:
    s.answer_integer(s.contact_steps(s.numbers(0, 3)))


def start_contact_detection(s: Script) -> None:
    s.watch_contact(s.numbers(0, 3))


def stop_contact_detection(s: Script) -> None:
    s.watch_contact(None)
    s.answer_integer(s.contact_step_back)


def read_contact_detection(s: Script) -> None:
    s.answer_integer(s.contact_step_back)


def protective_stop(s: Script) -> None:
    s.arm.protective_stop("protective_stop() of the program")


def watchdog(s: Script) -> None:
    s.arm_watchdog(s.number(0))


# --- load and tool


def set_payload(s: Script) -> None:
    """A centre of gravity of exactly zero keeps the one before, as the script does."""
    s.memory.installation.payload_kg = s.number(0)
    if any(s.numbers(1, 3)):
        s.memory.installation.payload_cog_m = tuple(s.numbers(1, 3))


def set_target_payload(s: Script) -> None:
    set_payload(s)
    s.memory.installation.payload_inertia_kg_m2 = tuple(s.numbers(4))


def set_tool(s: Script) -> None:
    s.arm.T_flange_tool = frame_of(s.numbers(0))


def get_tool(s: Script) -> None:
    s.answer(pose_of(s.arm.T_flange_tool))


def zero_sensor(s: Script) -> None:
    s.arm.dynamics.zero_sensor(s.arm.arm.forward(s.arm.joints.q_rad.tolist())[0], s.memory.installation)


def set_gravity(s: Script) -> None:
    s.memory.installation.gravity_m_s2 = tuple(s.numbers(0, 3))


# --- questions


def step_time(s: Script) -> None:
    s.answer([TICK_S])


def joints_before(s: Script) -> None:
    """i1 cycles ago, as far back as is remembered."""
    history = s.arm.history_rad
    back = min(max(s.integer(1), 0), len(history) - 1)
    s.answer(history[-1 - back].tolist())


def target_waypoint(s: Script) -> None:
    s.answer(pose_of(s.arm.arm.tool(s.arm.setpoint.q_rad.tolist(), s.arm.T_flange_tool)))


def joint_torques(s: Script) -> None:
    """Without those that the arm itself and the stated payload need: about zero where nothing touches the arm."""
    qdd_rad_s2 = s.arm.setpoint.qdd_rad_s2
    s.answer(s.arm.dynamics.outer_torque_nm(s.arm.joints, qdd_rad_s2, s.memory.installation).tolist())


def mass_matrix(s: Script) -> None:
    if s.has_dynamics:
        s.answer_matrix(s.arm.dynamics.mass_matrix_kg_m2(s.arm.joints.q_rad))


def coriolis_torques(s: Script) -> None:
    if s.has_dynamics:
        s.answer(s.arm.dynamics.coriolis_nm(s.arm.joints.q_rad, s.arm.joints.qd_rad_s).tolist())


def target_accelerations(s: Script) -> None:
    if s.has_dynamics:
        s.answer(s.arm.setpoint.qdd_rad_s2.tolist())


def jacobian(s: Script) -> None:
    if s.has_dynamics:
        s.answer_matrix(s.arm.arm.jacobian(s.arm.joints.q_rad.tolist(), s.arm.T_flange_tool)[0])


def jacobian_rate(s: Script) -> None:
    if s.has_dynamics:
        joints = s.arm.joints
        s.answer_matrix(s.arm.dynamics.jacobian_rate(joints.q_rad, joints.qd_rad_s, s.arm.T_flange_tool))


def flange_pose(s: Script) -> None:
    s.answer(pose_of(s.arm.arm.forward(s.arm.joints.q_rad.tolist())[0]))


def forward_now(s: Script) -> None:
    s.answer(pose_of(s.arm.arm.tool(s.arm.joints.q_rad.tolist(), s.arm.T_flange_tool)))


def forward(s: Script) -> None:
    s.answer(pose_of(s.arm.arm.tool(s.numbers(0), frame_of(s.numbers(6)))))


def inverse_near(s: Script) -> None:
    s.answer(s.arm.inverse(frame_of(s.numbers(0)), s.numbers(6)).tolist())


def inverse(s: Script) -> None:
    s.answer(s.arm.inverse(frame_of(s.numbers(0))).tolist())


def has_inverse_near(s: Script) -> None:
    s.answer_integer(_reaches(s, s.numbers(6)))


def has_inverse(s: Script) -> None:
    s.answer_integer(_reaches(s, None))


def pose_is_safe(s: Script) -> None:
    s.answer_integer(_reaches(s, None))


def joints_are_safe(s: Script) -> None:
    s.answer_integer(int(s.arm.within_limits(s.numbers(0))))


def multiply_poses(s: Script) -> None:
    s.answer(pose_of(compose(frame_of(s.numbers(0)), frame_of(s.numbers(6)))))


def is_steady(s: Script) -> None:
    s.answer_integer(int(s.arm.steady))


def freedrive_on(s: Script) -> None:
    s.arm.freedrive = True


def freedrive_off(s: Script) -> None:
    s.arm.freedrive = False


def freedrive_status(s: Script) -> None:
    s.answer_integer(0)  # normal


def no_effect(s: Script) -> None:
    """Accepted, and done at once."""


def _reaches(s: Script, near_rad: list[float] | None) -> int:
    try:
        s.arm.inverse(frame_of(s.numbers(0)), near_rad)
    except MoveRefused:
        return 0
    return 1


COMMANDS: dict[int, Command] = {
    1: move_joints,
    2: move_joints_to_pose,
    3: move_line,
    4: move_line_to_joints,
    6: no_effect,  # force mode
    7: no_effect,
    8: zero_sensor,
    9: speed_joints,
    10: speed_line,
    11: servo_joints,
    12: servo_circle,
    15: speed_stop,
    16: servo_stop,
    17: set_payload,
    18: no_effect,  # teach mode
    19: no_effect,
    20: no_effect,  # force mode damping and gain
    21: no_effect,
    24: servo_line,
    25: tool_contact,
    26: step_time,
    27: joints_before,
    28: target_waypoint,
    29: set_tool,
    30: inverse_near,
    31: protective_stop,
    33: stop_line,
    34: stop_joints,
    35: watchdog,
    36: pose_is_safe,
    37: joints_are_safe,
    38: joint_torques,
    39: multiply_poses,
    40: get_tool,
    41: jog_start,
    42: jog_stop,
    43: forward_now,
    44: forward,
    45: move_path,
    46: inverse,
    47: is_steady,
    51: move_until_contact,
    52: freedrive_on,
    53: freedrive_off,
    54: freedrive_status,
    56: no_effect,  # force input
    57: no_effect,
    58: flange_pose,
    59: set_gravity,
    60: has_inverse,
    61: has_inverse_near,
    62: start_contact_detection,
    63: stop_contact_detection,
    64: read_contact_detection,
    65: set_target_payload,
    66: no_effect,  # direct torque, from PolyScope 5.26 on
    67: mass_matrix,
    68: coriolis_torques,
    69: target_accelerations,
    70: jacobian,
    71: jacobian_rate,
}
