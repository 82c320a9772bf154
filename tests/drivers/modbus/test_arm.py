"""What a program that was frozen sends to a PLC afterwards, with a line that only takes notes."""

from collections.abc import Callable

import pytest

from drivers.errors import DeviceRefused, DeviceStale
from drivers.modbus.arm import BEGIN_LIMIT_S, ModbusArm, State
from drivers.modbus.register_map import ANSWERS, COMMANDS, Register, RegisterMap

from .conftest import HOME

NAMES = {"actual_q_rad": 6, **COMMANDS, **ANSWERS}
REGISTERS = {name: Register(name, 10 * at, "int16", count, 1e-3) for at, (name, count) in enumerate(NAMES.items())}
SHOWN_NUMBER = 7


class Clock:
    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds


class Notes:
    """Keeps what is written; the program stands, and shows its last command. `wrote` is called after each write."""

    place = "robot"

    def __init__(self, wrote: Callable[[str], None]) -> None:
        self.written: list[str] = []
        self.wrote = wrote

    def connect(self) -> None: ...

    def read(self, table: str, address: int, count: int) -> list[int]:
        return [{"state": State.ARRIVED, "state_number": SHOWN_NUMBER}.get(_at(address), 0) * 1000][:count]

    def write(self, address: int, values: list[int]) -> None:
        self.written.append(_at(address))
        self.wrote(_at(address))


def _at(address: int) -> str:
    return next(name for name, register in REGISTERS.items() if register.address == address)


@pytest.mark.parametrize("frozen_at", ["command_q_rad", "command_speed_rad_s", "host_life"])
@pytest.mark.parametrize("frozen_s", [BEGIN_LIMIT_S - 0.5, BEGIN_LIMIT_S + 0.5])
def test_an_order_that_is_older_than_its_deadline_is_not_sent(frozen_at: str, frozen_s: float) -> None:
    clock = Clock()

    def freeze(name: str) -> None:
        clock.time_s += frozen_s if name == frozen_at else 0.0

    line = Notes(lambda name: None)
    arm = ModbusArm(line, RegisterMap(REGISTERS.values()), clock=clock)  # type: ignore[arg-type]
    arm.connect()
    line.written.clear()
    line.wrote = freeze
    with pytest.raises(DeviceStale, match="is not carried out" if frozen_s > BEGIN_LIMIT_S else "was not taken"):
        arm.move_joints(HOME, 1.0, 1.0)
    assert ("command_number" in line.written) is (frozen_s < BEGIN_LIMIT_S)
    assert line.written[-1] == "stop"
    line.wrote = lambda name: None
    with pytest.raises(DeviceRefused, match="connect again"):
        arm.move_joints(HOME, 1.0, 1.0)
