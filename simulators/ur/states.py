"""The controller's states by their RTDE numbers.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", tables of robot mode, safety mode, runtime state,
robot status bits and safety status bits; joint mode from the same guide.
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
