"""An IRB 120 class controller behind Modbus, over TCP and over a serial line, at four times real time."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.recording.rig.devices import RobotDevice
from calibeam.devices.robot import emulated_robot, robot_of
from drivers.clock import SystemClock
from drivers.device import Device, Movable
from simulators.process import Emulators

RIG_PATH = Path(__file__).parents[3] / "rigs" / "irb120-modbus.toml"
HURRY = 4.0
HOME = np.array([0.0, 0.0, 0.3, 0.0, 0.5, 0.0])


@dataclass(frozen=True)
class Cell:
    """The emulators, and how to reach the controller."""

    emulators: Emulators
    device: RobotDevice

    def reader(self) -> Device:
        return robot_of(self.device, SystemClock()).reader

    def arm(self) -> Movable:
        return robot_of(self.device, SystemClock(), hurry=HURRY).arm()


@pytest.fixture(scope="session", params=["tcp", "rtu"])
def running(request, tmp_path_factory) -> Iterator[Cell]:
    rig, plain = load_rig(RIG_PATH), plain_rig(rig_text(RIG_PATH), str(RIG_PATH))
    plain["devices"] = {"robot": plain["devices"]["robot"]}
    if request.param == "rtu":
        del plain["devices"]["robot"]["host"], plain["devices"]["robot"]["port"]
        plain["devices"]["robot"]["serial_port"] = str(tmp_path_factory.mktemp("links") / "modbus")
    with Emulators(plain, time_scale=HURRY) as emulators:
        assert rig.devices.robot is not None
        yield Cell(emulators, emulated_robot(rig.devices.robot, emulators.address["robot"]))


@pytest.fixture
def cell(running: Cell) -> Iterator[Cell]:
    """Well again afterwards."""
    yield running
    running.emulators.clear()
    running.emulators.ask("robot.unlock")
    running.emulators.ask("robot.silence", on=False)
    running.emulators.ask("robot.program", on=True)


@pytest.fixture
def arm(cell: Cell) -> Iterator[Movable]:
    arm = cell.arm()
    try:
        arm.connect()
        arm.move_joints(HOME, 2.0, 10.0)
        yield arm
    finally:
        arm.close()
