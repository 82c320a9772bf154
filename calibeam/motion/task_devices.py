"""What a program of one's own needs beside the arm: a hand on a digital output, a belt by its encoder, what READ reads.

All of it is watched as the arm is: an encoder that falls silent stops the arm, an output that does not switch ends the
program.
"""

import math
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.errors import TaskError
from acquisition.motion.kinematics import transform
from acquisition.motion.paths.path import STANDING, BeltState
from acquisition.motion.run_task import GRASP, no_camera, no_hand
from acquisition.motion.task.program import Read, unrolled
from acquisition.motion.task.task_file import BeltEncoder, Hand, Task
from acquisition.recording.files import parse_toml, read_text
from acquisition.recording.files.bounds import ZERO, Rotation, Vector
from acquisition.recording.rig import Rig
from acquisition.wires.streams import Pump
from calibeam.devices.encoders import encoder_driver
from calibeam.devices.instruments import open_camera
from calibeam.motion.robot import StreamedRobot
from drivers.clock import Clock
from drivers.device import Block
from drivers.errors import DeviceRefused
from drivers.ur.dashboard import UrOutputs

if TYPE_CHECKING:
    from drivers.camera.device import Camera as CameraDevice

Floats = NDArray[np.float64]

SWITCHED_S = 1.0  # within which the controller's stream has to show an output switched
RATE_S = 0.2  # of the belt's past, from which its speed is taken


class PartFile(Struct, frozen=True, forbid_unknown_fields=True):
    """What a vision system writes for READ: one transform."""

    origin_m: Vector = ZERO
    rotation_rad: Rotation = ZERO


@dataclass(frozen=True)
class TaskDevices:
    """As `acquisition.motion.run_task.Around` wants them."""

    read: Callable[[str], Floats] = no_camera
    act: Callable[[str], None] = no_hand
    belt: Callable[[], BeltState] = lambda: STANDING


class OutputHand:
    """GRASP and RELEASE by a digital output of the controller, whose stream reports whether it has switched."""

    def __init__(self, hand: Hand, outputs: UrOutputs, robot: StreamedRobot) -> None:
        self._hand, self._outputs, self._robot = hand, outputs, robot

    def act(self, action: str) -> None:
        """Returns once the output has switched. DeviceRefused where it does not, or nothing reports it."""
        level = self._hand.closed if action == GRASP else not self._hand.closed
        self._outputs.switch(self._hand.bit, level)
        deadline_s = self._robot.clock.now_s() + SWITCHED_S
        while self._level(self._robot.pump.latest()) != level:
            now_s = self._robot.clock.now_s()
            if now_s > deadline_s:
                raise DeviceRefused(
                    f"[hand] output {self._hand.output}: the controller took {action}, but its stream shows no change "
                    f"within {SWITCHED_S:.0f} s; check the wiring and the pendant's I/O tab"
                )
            self._robot.pump.wait(now_s, SWITCHED_S)

    def _level(self, block: Block | None) -> bool | None:
        if block is None or "digital_outputs" not in block.values:
            return None
        return bool(int(block.values["digital_outputs"][-1]) >> self._hand.bit & 1)


class EncoderBelt:
    """The belt's way since it was last set to zero, by the blocks of one encoder; from any thread."""

    def __init__(self, m_per_turn: float, clock: Clock, wait_s: float = RATE_S) -> None:
        self._m_per_rad, self._clock, self._wait_s = m_per_turn / math.tau, clock, wait_s
        self._lock = threading.Lock()
        self._host_s, self._m = np.empty(0), np.empty(0)
        self._zero_m = 0.0

    def heard(self, block: Block) -> None:
        """Samples (sample, 1) of the encoder; lost ones are NaN."""
        position_rad = block.values["position_rad"][:, 0]
        good = np.isfinite(position_rad)
        with self._lock:
            host_s = np.concatenate([self._host_s, block.host_s[good]])
            m = np.concatenate([self._m, self._m_per_rad * position_rad[good]])
            new = host_s > (host_s[-1] - self._wait_s if host_s.size else 0.0)
            self._host_s, self._m = host_s[new], m[new]

    def zero(self) -> None:
        """The belt counts from where it is now: a part was seen."""
        state = self._absolute()
        with self._lock:
            self._zero_m = state.s_m

    def now(self) -> BeltState:
        """Metres since zero and m/s, carried on from the newest sample at the speed of the last ones."""
        state = self._absolute()
        return BeltState(state.s_m - self._zero_m, state.rate_m_s)

    def _absolute(self) -> BeltState:
        with self._lock:
            host_s, m = self._host_s, self._m
        if not host_s.size:
            return STANDING
        past_s = host_s - host_s[-1]
        rate_m_s = float(np.polyfit(past_s, m, 1)[0]) if np.unique(host_s).size > 2 else 0.0
        return BeltState(float(m[-1]) + rate_m_s * (self._clock.now_s() - float(host_s[-1])), rate_m_s)


def part_in_file(path: Path) -> Floats:
    """T (4, 4) of a file of origin_m and rotation_rad. TaskError names it and what is wrong."""
    entries = parse_toml(read_text(path, "part", TaskError), str(path), TaskError).checked(PartFile)
    return transform(entries.origin_m, entries.rotation_rad)


@contextmanager
def open_task_devices(task: Task, folder: Path, rig: Rig, robot: StreamedRobot, clock: Clock) -> Generator[TaskDevices]:
    """Connected while inside; files of READ are beside the task file, in `folder`. DeviceError, TaskError."""
    with ExitStack() as stack:
        act = no_hand if task.hand is None else _hand(task.hand, rig, robot, stack)
        belt = None if task.belt is None else _belt(task.belt, robot, clock, stack)
        reads = {step.transform for step in unrolled(task.program) if isinstance(step, Read)}
        by_camera = any(task.read[name].camera for name in reads & task.read.keys())
        eye = stack.enter_context(open_camera(rig.camera, clock)) if by_camera and rig.camera is not None else None

        def read(name: str) -> Floats:
            if belt is not None:
                belt.zero()
            reading = task.read[name]
            return _board(rig, eye) if reading.file is None else part_in_file(folder / reading.file)

        yield TaskDevices(read, act, (lambda: STANDING) if belt is None else belt.now)


def _hand(hand: Hand, rig: Rig, robot: StreamedRobot, stack: ExitStack) -> Callable[[str], None]:
    device = rig.devices.robot
    if device is None or device.host is None:
        raise TaskError(f"[hand] output {hand.output}: rig {rig.name} has no UR controller whose output it could be")
    outputs = UrOutputs(device.host)
    outputs.connect()
    stack.callback(outputs.close)
    return OutputHand(hand, outputs, robot).act


def _belt(entry: BeltEncoder, robot: StreamedRobot, clock: Clock, stack: ExitStack) -> EncoderBelt:
    belt = EncoderBelt(entry.m_per_turn, clock)
    device = encoder_driver(entry.encoder, clock)
    pump = Pump(device, clock, belt.heard, robot.supervisor.failed)
    device.connect()
    stack.callback(pump.stop)
    pump.start()
    pump.wait(-math.inf, 1.0)  # the first samples: a path on the belt is planned by them
    return belt


def _board(rig: Rig, eye: "CameraDevice | None") -> Floats:
    """T (4, 4) of the camera's board from the flange. TaskError where it is not in the picture."""
    from acquisition.centring.camera.board import Board, board_poses
    from acquisition.centring.camera.model import read_model

    if rig.camera is None or rig.camera.calibration is None or eye is None:
        raise TaskError(f"rig {rig.name} has no [camera] with a calibration; `calibeam camera` measures it")
    model = read_model(Path(rig.camera.calibration), rig.camera)
    seen = Board(rig.camera.board).find(eye.picture())
    poses = [] if seen is None else board_poses(model, seen)
    if not poses:
        raise TaskError("READ by the camera: its board is not in the picture; check the light and the position")
    out: Floats = model.T_flange_camera @ poses[0][0]
    return out
