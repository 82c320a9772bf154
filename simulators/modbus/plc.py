"""The motion program behind the registers: takes a command by its number, and brakes when told or when left alone.

Written from docs/protocols/modbus.md; what a site's own program does beyond it is not imitated.
"""

import math
from collections.abc import Sequence
from enum import IntEnum

from simulators.modbus.register_map import RegisterMap
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.states import SafetyMode

WRITTEN_BY_CLIENTS = (
    "command_q_rad",
    "command_speed_rad_s",
    "command_acceleration_rad_s2",
    "command_number",
    "stop",
    "host_life",
)
SILENCE_LIMIT_S = 1.0  # a moving arm brakes when host_life stood still for so long
DECELERATION_RAD_S2 = 6.0  # feels right for an arm of this size


class State(IntEnum):
    """Of the command with the number beside it."""

    NONE = 0
    MOVING = 1
    ARRIVED = 2
    REFUSED = 3
    STOPPED = 4


class Reason(IntEnum):
    """Why it was refused or stopped."""

    NONE = 0
    STOP = 1
    HOST_SILENT = 2
    OUT_OF_RANGE = 3
    PROTECTIVE_STOP = 4
    EMERGENCY_STOP = 5
    NOT_READY = 6


class MotionProgram:
    """One step each cycle. `running` False: the PLC has stopped, its registers stay as they are."""

    def __init__(self, arm: ArmController, registers: RegisterMap) -> None:
        self._arm, self._registers = arm, registers
        self.running = True
        self.state, self.reason, self.number = State.NONE, Reason.NONE, 0
        self._life = 0
        self._host_life, self._host_life_s = 0.0, 0.0
        self._stopping = Reason.NONE

    @property
    def can_move(self) -> bool:
        """The rig's map has the registers of the handshake."""
        return all(name in self._registers.entries for name in WRITTEN_BY_CLIENTS)

    def before_step(self, t_s: float) -> None:
        if not self.running:
            return
        self._life = (self._life + 1) & 0xFFFF
        if self.can_move:
            self._hear(t_s)
            self._guard(t_s)
            self._take()
        self._arm.before_step(t_s)

    def publish(self, readings: dict[str, Sequence[float]]) -> None:
        """The cycle's results into the registers."""
        if not self.running:
            return
        for name, values in readings.items():
            self._registers.put(name, values)
        for name, value in (
            ("life", self._life),
            ("state", self.state),
            ("state_number", self.number),
            ("reason", self.reason),
        ):
            self._registers.put(name, [value])

    def _hear(self, t_s: float) -> None:
        (life,) = self._registers.get("host_life")
        if life != self._host_life or self.state is not State.MOVING:
            self._host_life, self._host_life_s = life, t_s

    def _guard(self, t_s: float) -> None:
        """Watches a running move: its end, and every reason to end it early."""
        if self.state is not State.MOVING:
            return
        reason = self._reason_to_stop(t_s)
        if reason is not Reason.NONE and self._stopping is Reason.NONE:
            self._stopping = reason
            self._arm.stop(DECELERATION_RAD_S2)
        if not self._arm.moving:
            self.state = State.ARRIVED if self._stopping is Reason.NONE else State.STOPPED
            self.reason = self._stopping

    def _reason_to_stop(self, t_s: float) -> Reason:
        if self._registers.get("stop")[0] != 0.0:
            return Reason.STOP
        if t_s - self._host_life_s > SILENCE_LIMIT_S:
            return Reason.HOST_SILENT
        return self._safety()

    def _safety(self) -> Reason:
        power = self._arm.power
        if power.safety_mode is SafetyMode.PROTECTIVE_STOP:
            return Reason.PROTECTIVE_STOP
        if power.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP:
            return Reason.EMERGENCY_STOP
        return Reason.NONE if power.ready else Reason.NOT_READY

    def _take(self) -> None:
        """A new number is a new command; while the arm moves it waits."""
        number = int(self._registers.get("command_number")[0])
        if number == self.number or self.state is State.MOVING:
            return
        self.number, self._stopping = number, Reason.NONE
        self.reason = Reason.STOP if self._registers.get("stop")[0] != 0.0 else self._safety()
        if self.reason is Reason.NONE:
            self.reason = self._begin()
        self.state = State.MOVING if self.reason is Reason.NONE else State.REFUSED

    def _begin(self) -> Reason:
        q_rad = self._registers.get("command_q_rad")
        (speed,) = self._registers.get("command_speed_rad_s")
        (acceleration,) = self._registers.get("command_acceleration_rad_s2")
        if not all(map(math.isfinite, (*q_rad, speed, acceleration))):
            return Reason.OUT_OF_RANGE
        try:
            self._arm.move_joints(q_rad, speed, acceleration)
        except MoveRefused:
            return Reason.OUT_OF_RANGE
        return Reason.NONE
