"""A Modbus line on a serial port is opened with the settings of the rig file, wherever its plug is."""

import pytest

from drivers.errors import DeviceLost
from drivers.modbus import line
from drivers.modbus.line import ModbusLine, RtuAddress


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[tuple[object, ...]]:
    """Port, baud rate, parity and stop bits of every line that was opened."""
    lines: list[tuple[object, ...]] = []

    class Client:
        """pymodbus, as far as opening goes."""

        def __init__(self, port: str, **settings: object) -> None:
            lines.append((port, settings["baudrate"], settings["parity"], settings["stopbits"]))

        def connect(self) -> bool:
            return True

        def close(self) -> None: ...

    monkeypatch.setattr(line, "ModbusSerialClient", Client)
    return lines


def test_settings_and_the_plug_of_a_line(opened, monkeypatch: pytest.MonkeyPatch) -> None:
    plugs = iter(["/dev/ttyUSB0", "/dev/ttyUSB3"])
    monkeypatch.setattr(line, "find_port", lambda number: next(plugs) if number == "A7" else None)
    by_number = ModbusLine(RtuAddress(baud=9600, parity="even", stop_bits=2, serial_number="A7"))
    by_number.connect()
    by_number.connect()  # it came back elsewhere
    ModbusLine(RtuAddress("/dev/ttyS1")).connect()
    assert opened == [
        ("/dev/ttyUSB0", 9600, "E", 2),
        ("/dev/ttyUSB3", 9600, "E", 2),
        ("/dev/ttyS1", 115_200, "N", 1),
    ]


def test_a_plug_that_is_not_there_is_lost(opened) -> None:
    with pytest.raises(DeviceLost, match="no USB plug with serial number 'none such'"):
        ModbusLine(RtuAddress(serial_number="none such")).connect()
    assert opened == []
