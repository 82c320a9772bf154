"""The arm's motion controller: one set-point per cycle, in the controller's own readings, within the joints' limits.

It needs no wire: call `move_joints` and so on, then `before_step` once per TICK_S before the world is advanced, and
wait until `moving` is False. It is the one owner of the set-point, of power and of the safety state.

What it does not imitate: force mode, free-drive (`freedrive` is what was asked for over the wire; who guides the arm is
simulators/hand/world.py), path deviation and collision detection, reduced mode, jerk limits, blends.
"""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from simulators.ur.controller_kinematics import IDENTITY, Frame, NominalArm
from simulators.ur.dynamics import ArmWorld, Carried, Dynamics, Joints
from simulators.ur.moves import (
    Floats,
    Generator,
    JointMove,
    JointServo,
    JointSpeed,
    JointStop,
    Leg,
    LineMove,
    PathBlocked,
    PathMove,
    SetPoint,
    ToolSpeed,
    standing,
)
from simulators.ur.states import Power, SafetyMode
from simulators.wire import TICK_S

SPEED_LIMIT_RAD_S = math.pi  # UR5e user manual, technical specification: 180 deg/s on every joint
FASTEST_RAD_S = 1.05 * SPEED_LIMIT_RAD_S  # 5 %: a speed taken from the difference of two positions near the limit
EDGE_RAD = 1e-9  # rounding of a target exactly on the joint limit
ACCELERATION_LIMIT_RAD_S2 = 40.0  # the range that ur_rtde accepts
SAFETY_DECELERATION_RAD_S2 = 12.0  # stop category 2 under full control; feels right for 180 deg/s in 0.25 s
SETTLED_SPEED_RAD_S = 1e-4  # below this joint speed and following error a move counts as ended
SETTLED_ERROR_RAD = 1e-5
SETTLE_LIMIT_S = 1.0  # an arm that keeps trembling does not keep its program waiting longer
HISTORY_STEPS = 100  # what get_actual_joint_positions_history can look back


class MoveRefused(Exception):  # noqa: N818 - an answer of the controller, not an error of the emulator
    """The arm may not or cannot make this move; the message states why."""


class ArmController:
    """Motion of one arm; an `Instrument` of simulators.wire."""

    name = "ur"

    def __init__(
        self, world: ArmWorld, arm: NominalArm, lower_rad: Sequence[float], upper_rad: Sequence[float],
        reading_step_rad: float = 0.0, unlock_delay_s: float = 0.0, carried: Carried | None = None,
    ) -> None:  # fmt: skip
        """Limits (n,); `reading_step_rad`: one count of the joint encoders, which no following error can undercut."""
        self.arm, self.power = arm, Power(unlock_delay_s)
        self.dynamics = Dynamics(world, arm, carried or Carried())
        self.T_flange_tool: Frame = IDENTITY
        self.speed_scaling = 1.0
        self.freedrive = False
        self.stop_reason = ""  # of the last protective stop
        self._world = world
        self._lower_rad, self._upper_rad = list(lower_rad), list(upper_rad)
        self._settled_error_rad = SETTLED_ERROR_RAD + reading_step_rad
        self._joints = world.joints()
        self._joints_s = world.time_s
        self.setpoint = standing(self._joints.q_rad.copy())
        self._motion: Generator | None = None
        self._arrived_s = -math.inf
        self.history_rad: deque[Floats] = deque(maxlen=HISTORY_STEPS)  # actual joints, newest last

    # --- what there is to know

    @property
    def joints(self) -> Joints:
        """Sensor values at the world's present time."""
        if self._joints_s != self._world.time_s:
            self._joints, self._joints_s = self._world.joints(), self._world.time_s
        return self._joints

    @property
    def moving(self) -> bool:
        """A motion is under way, or the arm has not come to rest on its end yet."""
        if self._motion is not None:
            return True
        if self._world.time_s - self._arrived_s > SETTLE_LIMIT_S:
            return False
        error_rad = np.abs(self.joints.q_rad - self.setpoint.q_rad).max()
        return bool(error_rad >= self._settled_error_rad or np.abs(self.joints.qd_rad_s).max() >= SETTLED_SPEED_RAD_S)

    @property
    def steady(self) -> bool:
        """Nothing commanded, and the set-point has rested for half a second (URScript is_steady: 500 ms)."""
        return self._motion is None and self._world.time_s - self._arrived_s >= 0.5

    @property
    def path_leg(self) -> int:
        """Index of the present leg of a path, 0 for a single move."""
        return max(0, self._motion.leg) if isinstance(self._motion, PathMove) else 0

    @property
    def limits_rad(self) -> list[tuple[float, float]]:
        """Lower and upper limit of each joint."""
        return list(zip(self._lower_rad, self._upper_rad, strict=True))

    def within_limits(self, q_rad: ArrayLike) -> bool:
        q = np.asarray(q_rad, dtype=np.float64)
        return bool(np.isfinite(q).all() and np.all(q >= self._lower_rad) and np.all(q <= self._upper_rad))

    def inverse(self, T_base_tool: Frame, q_near_rad: Sequence[float] | None = None) -> Floats:
        """Joints (n,) that bring the tool there, near the present ones. MoveRefused when there are none in range."""
        near_rad = self.setpoint.q_rad.tolist() if q_near_rad is None else q_near_rad
        q_rad = self.arm.inverse(T_base_tool, near_rad, self.T_flange_tool)
        if q_rad is None or not self.within_limits(q_rad):
            raise MoveRefused(f"no joint position near {near_rad} rad reaches the tool pose {list(T_base_tool[9:])} m")
        return q_rad

    # --- verbs; MoveRefused when the arm may not or cannot

    def move_joints(self, q_rad: ArrayLike, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        self._begin_path([self.joint_leg(q_rad, speed_rad_s, acceleration_rad_s2)])

    def move_line(self, T_base_tool: Frame, speed_m_s: float, acceleration_m_s2: float) -> None:
        self._begin_path([self.line_leg(T_base_tool, speed_m_s, acceleration_m_s2)])

    def move_path(self, legs: Sequence[Leg]) -> None:
        self._begin_path(legs)

    def joint_leg(self, q_rad: ArrayLike, speed_rad_s: float, acceleration_rad_s2: float) -> Leg:
        self._check_rates(speed_rad_s, acceleration_rad_s2)
        speed_rad_s = min(speed_rad_s, SPEED_LIMIT_RAD_S)
        acceleration_rad_s2 = min(acceleration_rad_s2, ACCELERATION_LIMIT_RAD_S2)
        end_rad = self._checked(q_rad)
        return lambda start_rad: JointMove(start_rad, end_rad, speed_rad_s, acceleration_rad_s2)

    def line_leg(self, T_base_tool: Frame, speed_m_s: float, acceleration_m_s2: float) -> Leg:
        self._check_rates(speed_m_s, acceleration_m_s2)
        if not np.isfinite(T_base_tool).all():
            raise MoveRefused(f"straight line to {list(T_base_tool)}: not a pose")
        arm, tool = self.arm, self.T_flange_tool
        return lambda start_rad: LineMove(arm, tool, start_rad, T_base_tool, speed_m_s, acceleration_m_s2)

    def servo_joints(self, q_rad: ArrayLike, lookahead_s: float, gain: float) -> None:
        target_rad = self._checked(q_rad)
        self._check_ready()
        if not isinstance(self._motion, JointServo):
            self._motion = JointServo(SPEED_LIMIT_RAD_S, ACCELERATION_LIMIT_RAD_S2)
        self._motion.aim(target_rad, lookahead_s, gain)

    def speed_joints(self, qd_rad_s: ArrayLike, acceleration_rad_s2: float, time_s: float = math.inf) -> None:
        self._check_rates(1.0, acceleration_rad_s2)
        wanted = np.clip(self._finite(qd_rad_s), -SPEED_LIMIT_RAD_S, SPEED_LIMIT_RAD_S)
        self._begin(JointSpeed(wanted, min(acceleration_rad_s2, ACCELERATION_LIMIT_RAD_S2), time_s))

    def speed_tool(self, speed: ArrayLike, acceleration_m_s2: float) -> None:
        """`speed`: (6,) m/s and rad/s of the tool in the base frame."""
        self._check_rates(1.0, acceleration_m_s2)
        self._begin(ToolSpeed(self.arm, self.T_flange_tool, self._finite(speed).tolist(), acceleration_m_s2))

    def stop(self, deceleration_rad_s2: float = SAFETY_DECELERATION_RAD_S2) -> None:
        """Joints to rest; works in every state, and does nothing when the arm rests."""
        self._rest(JointStop(_usable(deceleration_rad_s2)))

    def stop_tool(self, deceleration_m_s2: float) -> None:
        """The tool to rest on its straight line."""
        self._rest(ToolSpeed(self.arm, self.T_flange_tool, [0.0] * 6, _usable(deceleration_m_s2)))

    def end_stream(self) -> None:
        """A servo or speed motion comes to rest; a move with an end stays."""
        if self._motion is not None and not isinstance(self._motion, PathMove | JointStop):
            self.stop()

    def protective_stop(self, reason: str = "asked for") -> None:
        """The joints brake and hold; every verb is refused until `unlock`."""
        self.stop()
        self.stop_reason = reason
        self.power.protective_stop()

    def unlock(self) -> bool:
        """False while the controller still refuses to release a protective stop."""
        return self.power.unlock()

    def emergency_stop(self, pressed: bool = True) -> None:
        """The joints brake, then the power is off; released, it needs power on and brake release."""
        if pressed:
            self.stop()
        self.power.emergency_stop(pressed)

    # --- time

    def before_step(self, t_s: float) -> None:
        """Sends the next set-point to the world. `t_s`: emulated time of this cycle."""
        self.power.tick(t_s)
        self.history_rad.append(self.joints.q_rad)
        if self._motion is None:
            return
        then = self._next(self._motion)
        if then is None:
            return
        self.setpoint = then
        self._world.command(then.q_rad)
        if self._motion.finished:
            self._motion = None
            self._arrived_s = t_s + TICK_S
            self.setpoint = standing(then.q_rad)

    def after_step(self, t_s: float) -> None:
        """Nothing to do: sensors are read when somebody asks."""

    def _next(self, motion: Generator) -> SetPoint | None:
        """None when the arm stays where it is."""
        try:
            if isinstance(motion, PathMove):
                return self._next_on_path(motion, self.speed_scaling)
            then = motion.step(self.setpoint, TICK_S)
            if not isinstance(motion, JointStop):
                self._check_step(then)
            return then
        except PathBlocked as blocked:
            self.protective_stop(str(blocked))
            return None if self._motion is None else self._motion.step(self.setpoint, TICK_S)

    def _next_on_path(self, motion: PathMove, scaling: float) -> SetPoint | None:
        """A path runs in its own time, which the speed slider stretches; at zero the arm waits on it."""
        if scaling <= 0.0:
            return None
        then = motion.step(self.setpoint, scaling * TICK_S)
        self._check_step(then)
        return SetPoint(then.q_rad, scaling * then.qd_rad_s, scaling * scaling * then.qdd_rad_s2)

    def _check_step(self, then: SetPoint) -> None:
        """PathBlocked where a joint is too fast, or could no longer brake inside its range."""
        joints = zip(then.q_rad.tolist(), then.qd_rad_s.tolist(), self._lower_rad, self._upper_rad, strict=True)
        for number, (q, qd, lower, upper) in enumerate(joints, start=1):
            if not -FASTEST_RAD_S <= qd <= FASTEST_RAD_S:
                raise PathBlocked(
                    f"joint {number} at {qd:.2f} rad/s is over the limit of {SPEED_LIMIT_RAD_S:.2f} rad/s"
                )
            rest = q + qd * abs(qd) / (2.0 * SAFETY_DECELERATION_RAD_S2)
            if (qd > 0.0 and rest > upper + EDGE_RAD) or (qd < 0.0 and rest < lower - EDGE_RAD):
                raise PathBlocked(f"joint {number} at {q:.4f} rad reaches its limit")

    # --- beginnings

    def _begin_path(self, legs: Sequence[Leg]) -> None:
        self._check_ready()
        under_way = bool(self.setpoint.qd_rad_s.any())  # a move begins from rest
        self._motion = PathMove(legs, JointStop(SAFETY_DECELERATION_RAD_S2) if under_way else None)

    def _begin(self, motion: Generator) -> None:
        self._check_ready()
        self._motion = motion

    def _rest(self, motion: Generator) -> None:
        if self._motion is None:
            return
        self._motion = motion if self.setpoint.qd_rad_s.any() else None
        self._arrived_s = self._world.time_s

    def _check_ready(self) -> None:
        if self.power.safety_mode is not SafetyMode.NORMAL:
            raise MoveRefused(f"the arm is in {self.power.safety_mode.name}: {self.stop_reason or 'unlock it first'}")
        if not self.power.ready:
            raise MoveRefused(f"the arm is in {self.power.robot_mode.name}; power on and release the brakes first")

    def _check_rates(self, speed: float, acceleration: float) -> None:
        if not (0.0 < speed < math.inf and 0.0 < acceleration < math.inf):
            raise MoveRefused(f"speed {speed}, acceleration {acceleration}: both must be positive and finite")

    def _finite(self, values: ArrayLike) -> Floats:
        array = np.array(values, dtype=np.float64)
        if array.shape != (self.arm.n_joints,) or not np.isfinite(array).all():
            raise MoveRefused(f"{array.tolist()}: {self.arm.n_joints} finite numbers are needed")
        return array

    def _checked(self, q_rad: ArrayLike) -> Floats:
        q = self._finite(q_rad)
        if not self.within_limits(q):
            raise MoveRefused(f"joints {q.tolist()} rad lie outside the joint range")
        return q


def _usable(deceleration: float) -> float:
    """A stop must not fail: whatever makes no sense becomes the safety deceleration."""
    return deceleration if 0.0 < deceleration <= ACCELERATION_LIMIT_RAD_S2 else SAFETY_DECELERATION_RAD_S2
