"""What the controller knows in one cycle, worked out only where a client has asked for it."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

from simulators.ur.controller_kinematics import (
    IDENTITY,
    Axis,
    Frame,
    Pose,
    Vector,
    compose,
    invert,
    pose_of,
    rotate,
    tool_speed,
)
from simulators.ur.dynamics import Joints
from simulators.ur.motion import ArmController
from simulators.ur.moves import SetPoint
from simulators.ur.registers import Memory
from simulators.ur.states import JOINT_MODES, SAFETY_BITS, JointMode, RobotMode, RobotStatus, RuntimeState
from simulators.wire import TICK_S, DeviceClock

TORQUE_PER_CURRENT_NM_A = (11.7, 11.7, 11.7, 7.0, 7.0, 7.0)
# at the joint: gear 101 x motor constants of the size 3 and size 1 joints, about; only the ratio of joints matters here
ELBOW = 2  # the third axis
POWERED = (RobotMode.POWER_ON, RobotMode.IDLE, RobotMode.RUNNING)
POWERED_BIT, RUNNING_BIT = int(RobotStatus.POWER_ON), int(RobotStatus.PROGRAM_RUNNING)  # flags combine slowly

T = TypeVar("T")


class once(Generic[T]):  # noqa: N801 - reads as a decorator
    """As functools.cached_property, without the lock that it takes before Python 3.12: a third of a cycle's cost."""

    def __init__(self, work_out: Callable[[Any], T]) -> None:
        self._work_out, self._name = work_out, work_out.__name__

    @overload
    def __get__(self, owner: None, kind: type) -> "once[T]": ...
    @overload
    def __get__(self, owner: object, kind: type) -> T: ...
    def __get__(self, owner: object | None, kind: type) -> "once[T] | T":
        if owner is None:
            return self
        value = owner.__dict__[self._name] = self._work_out(owner)
        return value


class Readout:
    """One cycle; made again every tick."""

    def __init__(
        self, tick: int, arm: ArmController, memory: Memory, runtime: RuntimeState, clock: DeviceClock | None = None
    ) -> None:
        self.tick = tick
        self.timestamp_s = tick * TICK_S if clock is None else clock.tells(tick * TICK_S)
        self.arm, self.memory, self.runtime = arm, memory, runtime
        self.setpoint: SetPoint = arm.setpoint
        self.joints: Joints = arm.joints

    @once
    def q_rad(self) -> list[float]:
        return self.joints.q_rad.tolist()

    @once
    def qd_rad_s(self) -> list[float]:
        return self.joints.qd_rad_s.tolist()

    @once
    def torque_nm(self) -> list[float]:
        return self.joints.torque_nm.tolist()

    @once
    def current_a(self) -> list[float]:
        return [torque / ratio for torque, ratio in zip(self.torque_nm, TORQUE_PER_CURRENT_NM_A, strict=True)]

    @once
    def temperature_degC(self) -> list[float]:
        return self.joints.temperature_degC.tolist()

    @once
    def target_q_rad(self) -> list[float]:
        return self.setpoint.q_rad.tolist()

    @once
    def target_qd_rad_s(self) -> list[float]:
        return self.setpoint.qd_rad_s.tolist()

    @once
    def target_qdd_rad_s2(self) -> list[float]:
        return self.setpoint.qdd_rad_s2.tolist()

    @once
    def flange(self) -> Frame:
        return self.arm.arm.forward(self.q_rad)[0]

    @once
    def _actual_tool(self) -> tuple[Frame, tuple[Axis, ...]]:
        T_base_flange, axes = self.arm.arm.forward(self.q_rad)
        return compose(T_base_flange, self.arm.T_flange_tool), axes

    @once
    def _target_tool(self) -> tuple[Frame, tuple[Axis, ...]]:
        T_base_flange, axes = self.arm.arm.forward(self.target_q_rad)
        return compose(T_base_flange, self.arm.T_flange_tool), axes

    @once
    def tool_pose(self) -> Pose:
        return pose_of(self._actual_tool[0])

    @once
    def target_tool_pose(self) -> Pose:
        return pose_of(self._target_tool[0])

    @once
    def tool_speed(self) -> Pose:
        return tool_speed(self._actual_tool[1], self._actual_tool[0], self.qd_rad_s)

    @once
    def target_tool_speed(self) -> Pose:
        return tool_speed(self._target_tool[1], self._target_tool[0], self.target_qd_rad_s)

    @once
    def tool_wrench(self) -> Pose:
        return self.arm.dynamics.tool_wrench(self.flange, self._actual_tool[0], self.memory.installation)

    @once
    def raw_wrench(self) -> Pose:
        return self.arm.dynamics.raw_wrench(self.flange)

    @once
    def accelerometer_m_s2(self) -> Vector:
        """In the axes of the flange, of an arm that stands."""
        return rotate(invert(self.flange), self.memory.installation.gravity_m_s2)

    @once
    def elbow_m(self) -> Vector:
        return self._actual_tool[1][ELBOW][3:]

    @once
    def elbow_speed_m_s(self) -> Vector:
        axes = self._actual_tool[1]
        return tool_speed(axes[:ELBOW], (*IDENTITY[:9], *self.elbow_m), self.qd_rad_s[:ELBOW])[:3]

    @once
    def joint_mode(self) -> tuple[int, ...]:
        return (JOINT_MODES.get(self.arm.power.robot_mode, JointMode.POWER_OFF),) * len(self.q_rad)

    @once
    def safety_bits(self) -> int:
        return int(SAFETY_BITS[self.arm.power.safety_mode])

    @once
    def robot_bits(self) -> int:
        bits = POWERED_BIT if self.arm.power.robot_mode in POWERED else 0
        return bits | RUNNING_BIT if self.runtime is RuntimeState.PLAYING else bits

    @once
    def tool_offset(self) -> Pose:
        return pose_of(self.arm.T_flange_tool)
