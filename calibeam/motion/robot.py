"""The controller alone, for motion by hand and for programs: read, watched, and streamed to; no detectors needed."""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.following import SetPoints
from acquisition.recording import RigFileError
from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import RobotDevice
from acquisition.wires.streams import Pump, Supervisor
from calibeam.devices.recorder import uninterrupted
from calibeam.devices.robot import emulated_robot, robot_of
from drivers.clock import Clock
from drivers.device import Block, Movable
from drivers.errors import DeviceError, DeviceRefused, DeviceStale

Floats = NDArray[np.float64]

WAIT_S = 0.5  # for a sample: the reader itself gives up after that
SETTLED_RAD = 2e-5  # between two samples: ten counts of a joint encoder, and slower than 10 mrad/s
SETTLE_TRIES = 500


class StreamedArm(Movable, SetPoints, Protocol):
    """A controller that takes set-points."""


@dataclass
class Track:
    """What the controller reported while it was read."""

    blocks: list[Block] = field(default_factory=list[Block])

    def clear(self) -> None:
        self.blocks.clear()

    def joints(self) -> tuple[Floats, Floats]:
        """Device time (sample,) and readings (sample, joint)."""
        blocks = list(self.blocks)
        if not blocks:
            return np.empty(0), np.empty((0, 0))
        q_rad = np.concatenate([block.values["actual_q_rad"] for block in blocks])
        return np.concatenate([block.device_s for block in blocks]), q_rad

    def host_s(self) -> Floats:
        """Host time (sample,) of the same."""
        return np.concatenate([np.empty(0), *(block.host_s for block in list(self.blocks))])


@dataclass(frozen=True)
class StreamedRobot:
    """A connected controller."""

    arm: StreamedArm
    pump: Pump
    track: Track
    supervisor: Supervisor
    clock: Clock

    def joints(self) -> Floats:
        """Readings (joint,) once the arm rests. DeviceError; DeviceStale where it never does."""
        return _resting(self.supervisor, self.pump, self.clock)


def _resting(supervisor: Supervisor, pump: Pump, clock: Clock) -> Floats:
    def newest() -> Floats:
        supervisor.check()
        out: Floats = pump.wait(clock.now_s(), WAIT_S)[-1].values["actual_q_rad"][-1]
        return out

    before = newest()
    for _ in range(SETTLE_TRIES):
        now = newest()
        if float(np.max(np.abs(now - before))) < SETTLED_RAD:
            return now
        before = now
    raise DeviceStale("robot: the arm does not come to rest; check whether something pushes it")


@contextmanager
def watched_joints(rig: Rig, clock: Clock) -> Generator[Callable[[], Floats]]:
    """Readings (joint,) of the rig's arm at rest, as often as asked; nothing that could move it is opened."""
    reader = robot_of(controller_of(rig), clock).reader
    supervisor = Supervisor(lambda: None, clock)
    pump = Pump(reader, clock, lambda block: None, supervisor.failed)
    reader.connect()
    pump.start()
    try:
        yield lambda: _resting(supervisor, pump, clock)
    finally:
        pump.stop()


def controller_of(rig: Rig) -> RobotDevice:
    """RigFileError: there is none in the rig."""
    device = rig.devices.robot
    if device is None:
        raise RigFileError(f"rig {rig.name}: no [devices.robot]; add how the controller is reached")
    return device


def as_streamed(arm: Movable, device: RobotDevice) -> StreamedArm:
    """DeviceRefused: it takes no set-points."""
    if not hasattr(arm, "servo_joints"):
        raise DeviceRefused(f"[devices.robot]: driver '{device.driver.value}' takes no set-points; use ur-rtde")
    return arm  # pyright: ignore[reportReturnType] - asked for in the line above


@contextmanager
def streamed_robot(rig: Rig, clock: Clock, emulated: Mapping[str, Any] | None = None) -> Generator[StreamedRobot]:
    """The rig's controller, read and ready to move. At the end the arm is stopped and every line released.

    RigFileError: no controller in the rig. DeviceRefused: one that takes no set-points; and every DeviceError.
    """
    device = controller_of(rig)
    robot = robot_of(device if emulated is None else emulated_robot(device, emulated), clock)
    arm = robot.arm()
    streamed = as_streamed(arm, device)
    supervisor, track = Supervisor(arm.hold, clock), Track()
    pump = Pump(robot.reader, clock, track.blocks.append, supervisor.failed)
    robot.reader.connect()
    pump.start()
    try:
        try:
            arm.connect()
        except DeviceError:
            supervisor.check()
            raise
        yield StreamedRobot(streamed, pump, track, supervisor, clock)
    finally:
        with uninterrupted():
            arm.close()
            pump.stop()
