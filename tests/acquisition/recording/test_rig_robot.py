"""[devices.robot] of a rig file: a UR controller has an address, a Modbus one a line and a register map."""

from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import load_rig, parse_rig, rig_text
from acquisition.recording.rig.devices import RegisterType, RobotDriver

RIGS = Path(__file__).parents[3] / "rigs"
TEXT = rig_text(RIGS / "irb120-modbus.toml")
UR = rig_text(RIGS / "ur5e-dual-psd.toml")


def test_the_shipped_register_maps() -> None:
    generic, ur = (load_rig(RIGS / name).devices.robot for name in ("irb120-modbus.toml", "ur5e-modbus.toml"))
    assert generic is not None
    assert ur is not None
    assert generic.driver is ur.driver is RobotDriver.MODBUS
    joints = next(register for register in generic.registers if register.name == "actual_q_rad")
    assert (joints.address, joints.type, joints.count, joints.word_order) == (0, RegisterType.FLOAT32, 6, "big")
    angles = next(register for register in ur.registers if register.name == "actual_q_rad")
    assert (angles.address, angles.scale, angles.turns_address) == (270, 0.001, 320)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('host = "127.0.0.2"', "", "either 'host' .* or 'serial_port'"),
        ('host = "127.0.0.2"', 'host = "a"\nserial_port = "b"', "and one only"),
        ('host = "127.0.0.2"', 'serial_port = "b"', "a serial line has none"),
        ('host = "127.0.0.2"', 'serial_port = "a"\nserial_number = "b"', "and one only"),
        ("rate_hz = 50.0", 'rate_hz = 50.0\nparity = "mark"', "parity"),
        ("rate_hz = 50.0", "rate_hz = 5000.0", "no controller serves so many polls"),
        ('name = "life"', 'name = "robot_mode"', "register robot_mode stands twice"),
        ("scale = 0.001", "scale = 0.0", "scale 0 loses the value"),
        ('type = "float32"', 'type = "float16"', "float16"),
        ("address = 12\n", "address = 70000\n", "70000"),
    ],
)
def test_modbus_sections_that_contradict_themselves(old, new, says) -> None:
    assert old in TEXT
    with pytest.raises(RigFileError, match=says):
        parse_rig(TEXT.replace(old, new, 1), "rig.toml")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('host = "127.0.0.2"', "", "needs the key 'host'"),
        ('host = "127.0.0.2"', 'host = "127.0.0.2"\nport = 502', "'port' belongs to driver \"modbus\""),
    ],
)
def test_ur_sections_that_contradict_themselves(old, new, says) -> None:
    assert old in UR
    with pytest.raises(RigFileError, match=says):
        parse_rig(UR.replace(old, new, 1), "rig.toml")
