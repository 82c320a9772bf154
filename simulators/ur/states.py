"""The controller's states by their RTDE numbers.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", tables of robot mode, safety mode, runtime state,
robot status bits and safety status bits; joint mode from the same guide.

Power and safety of the controller: which modes follow which, after how much emulated time.

What is not imitated: reduced, recovery, safeguard and three-position modes; the joints' own voltages while booting.
The times are assumed; real ones are seconds and depend on the arm.
"""

from enum import IntEnum, IntFlag


class RobotMode(IntEnum):
    """Power and brakes."""

    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7


class SafetyMode(IntEnum):
    """Why the arm may not move; only those that this emulator knows."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    ROBOT_EMERGENCY_STOP = 7


class RuntimeState(IntEnum):
    """The program."""

    STOPPING = 0
    STOPPED = 1
    PLAYING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5


class JointMode(IntEnum):
    """One joint; only those that this emulator knows."""

    POWER_OFF = 239
    BOOTING = 247
    IDLE = 255
    RUNNING = 253


class RobotStatus(IntFlag):
    """Bits of robot_status_bits."""

    POWER_ON = 1 << 0
    PROGRAM_RUNNING = 1 << 1
    TEACH_BUTTON = 1 << 2
    POWER_BUTTON = 1 << 3


class SafetyStatus(IntFlag):
    """Bits of safety_status_bits; only those that this emulator knows."""

    NORMAL = 1 << 0
    REDUCED = 1 << 1
    PROTECTIVE_STOPPED = 1 << 2
    ROBOT_EMERGENCY_STOPPED = 1 << 6
    EMERGENCY_STOPPED = 1 << 7
    STOPPED_DUE_TO_SAFETY = 1 << 10


SAFETY_BITS = {
    SafetyMode.NORMAL: SafetyStatus.NORMAL,
    SafetyMode.REDUCED: SafetyStatus.REDUCED,
    SafetyMode.PROTECTIVE_STOP: SafetyStatus.PROTECTIVE_STOPPED | SafetyStatus.STOPPED_DUE_TO_SAFETY,
    SafetyMode.ROBOT_EMERGENCY_STOP: (
        SafetyStatus.ROBOT_EMERGENCY_STOPPED | SafetyStatus.EMERGENCY_STOPPED | SafetyStatus.STOPPED_DUE_TO_SAFETY
    ),
}

JOINT_MODES = {
    RobotMode.RUNNING: JointMode.RUNNING,
    RobotMode.IDLE: JointMode.IDLE,
    RobotMode.POWER_ON: JointMode.BOOTING,
    RobotMode.BOOTING: JointMode.BOOTING,
}  # every other mode: POWER_OFF


STEP_OF_START_S = 0.5  # per mode on the way from off to idle, and from idle to running
SEQUENCES = {
    "power on": (RobotMode.BOOTING, RobotMode.POWER_ON, RobotMode.IDLE),
    "brake release": (RobotMode.RUNNING,),
}


class Power:
    """Robot mode and safety mode; `tick` lets the time pass."""

    def __init__(self, unlock_delay_s: float = 0.0) -> None:
        """`unlock_delay_s`: how long a protective stop refuses to be unlocked; 5 s on a real controller."""
        self.robot_mode = RobotMode.RUNNING
        self.safety_mode = SafetyMode.NORMAL
        self.unlock_delay_s = unlock_delay_s
        self._now_s = 0.0
        self._stopped_at_s = 0.0
        self._coming: list[tuple[float, RobotMode]] = []

    @property
    def ready(self) -> bool:
        """The arm may move."""
        return self.robot_mode is RobotMode.RUNNING and self.safety_mode is SafetyMode.NORMAL

    def tick(self, t_s: float) -> None:
        self._now_s = t_s
        while self._coming and t_s >= self._coming[0][0]:
            self.robot_mode = self._coming.pop(0)[1]

    def power_on(self) -> bool:
        """False when the emergency stop is still pressed; nothing to do when the power is on already."""
        if self.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP:
            return False
        if self.robot_mode is RobotMode.POWER_OFF and not self._coming:
            self._schedule("power on")
        return True

    def brake_release(self) -> bool:
        """Powers on first where needed, as a real controller does. False when the emergency stop is still pressed."""
        if not self.power_on():
            return False
        if self.robot_mode is not RobotMode.RUNNING and RobotMode.RUNNING not in [mode for _, mode in self._coming]:
            self._schedule("brake release")
        return True

    def power_off(self) -> None:
        self._coming.clear()
        self.robot_mode = RobotMode.POWER_OFF

    def protective_stop(self) -> None:
        if self.safety_mode is SafetyMode.NORMAL:
            self.safety_mode = SafetyMode.PROTECTIVE_STOP
            self._stopped_at_s = self._now_s

    def unlock(self) -> bool:
        """False while the controller still refuses (see `unlock_delay_s`)."""
        if self.safety_mode is SafetyMode.PROTECTIVE_STOP:
            if self._now_s - self._stopped_at_s < self.unlock_delay_s:
                return False
            self.safety_mode = SafetyMode.NORMAL
        return True

    def emergency_stop(self, pressed: bool) -> None:
        """Pressed: power off. Released: safety is normal again, the power stays off."""
        if pressed:
            self.safety_mode = SafetyMode.ROBOT_EMERGENCY_STOP
            self.power_off()
        elif self.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP:
            self.safety_mode = SafetyMode.NORMAL

    def _schedule(self, sequence: str) -> None:
        due_s = self._coming[-1][0] if self._coming else self._now_s
        for mode in SEQUENCES[sequence]:
            due_s += STEP_OF_START_S
            self._coming.append((due_s, mode))
