"""Who needs no word before an arm moves: nobody but emulators."""

import os
from pathlib import Path

import pytest

from acquisition.recording.rig.devices import RobotDevice, RobotDriver
from calibeam.emulation import moves_nothing_real


@pytest.mark.parametrize("host", ["127.0.0.3", "localhost", "::1"])
def test_a_controller_on_loopback_is_an_emulator(host: str) -> None:
    assert moves_nothing_real(RobotDevice(RobotDriver.UR_RTDE, host=host))


@pytest.mark.parametrize("host", ["192.168.1.10", "robot.site", "10.0.0.2"])
def test_a_controller_anywhere_else_is_asked_for(host: str) -> None:
    assert not moves_nothing_real(RobotDevice(RobotDriver.UR_RTDE, host=host))


def test_behind_a_serial_port_only_a_pseudo_terminal_is_none(tmp_path: Path) -> None:
    instrument, port = os.openpty()
    link = tmp_path / "plc"
    link.symlink_to(os.ttyname(port))
    assert moves_nothing_real(RobotDevice(RobotDriver.MODBUS, serial_port=str(link)))
    assert not moves_nothing_real(RobotDevice(RobotDriver.MODBUS, serial_port="/dev/ttyUSB0"))
    assert not moves_nothing_real(RobotDevice(RobotDriver.MODBUS, serial_number="FT4711"))
    os.close(port)
    os.close(instrument)
