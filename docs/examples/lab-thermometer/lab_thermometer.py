"""The driver of a thermometer that prints a line such as "23.41" over TCP."""

import math

import msgspec
import numpy as np

from calibeam.devices.others import DeviceKind
from drivers.clock import Clock
from drivers.device import Block, Channel, StreamDevice
from drivers.errors import DeviceStale, WireError
from drivers.transports.transport import TcpLine

LONGEST = 64  # bytes of a line


class Settings(msgspec.Struct, frozen=True):
    """Keys of `settings` in the rig file."""

    host: str
    port: int
    offset_degC: float = 0.0  # of its certificate


class LabThermometer(StreamDevice[TcpLine]):
    """One channel, temperature_degC: its name makes it the column temp_<name>_degC of every sample."""

    def __init__(self, settings: Settings, name: str, clock: Clock) -> None:
        super().__init__(name, clock)
        self._settings, self._begun, self._count = settings, b"", 0

    def _open(self) -> TcpLine:
        return TcpLine(self._settings.host, self._settings.port)

    def _set_up(self, line: TcpLine) -> None:
        self._begun = b""

    def _release(self, line: TcpLine) -> None:
        line.close()

    def describe(self) -> tuple[Channel, ...]:
        return (Channel("temperature_degC", "degC", resolution=0.01),)

    def read(self, timeout_s: float) -> Block:
        line, until_s = self._opened(), self._clock.now_s() + timeout_s
        while not (values := self._arrived()):
            left_s = self._left_s(until_s)
            if left_s <= 0.0:
                raise DeviceStale(f"{self.name}: no line for {timeout_s:.3g} s; check its plug and power")
            self._begun += line.read(256, left_s)
        n, self._count = len(values), self._count + len(values)
        numbers = np.arange(self._count - n, self._count)
        return Block(
            np.full(n, self._clock.now_s()), np.full(n, np.nan), numbers, {"temperature_degC": np.array(values)}
        )

    def _arrived(self) -> list[float]:
        *lines, self._begun = self._begun.split(b"\n")
        if len(self._begun) > LONGEST:
            raise WireError(f"{self.name}: {self._begun[:32]!r} has no end; is it the thermometer?")
        return [self._value(line) for line in lines if line.strip()]

    def _value(self, line: bytes) -> float:
        try:
            value = float(line) + self._settings.offset_degC
        except ValueError:
            value = math.nan
        if not -100.0 < value < 300.0:
            raise WireError(f"{self.name}: {line[:32]!r} is no temperature; is it the thermometer?")
        return value


KIND = DeviceKind(Settings, LabThermometer, emulator="lab_thermometer_emulator:build", silence_s=3.0)
