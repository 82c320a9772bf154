"""A thermometer that prints a line such as "23.41" ten times a second, as an instrument of calibeam.

Record it: python docs/examples/thermometer.py RIG.toml /dev/ttyUSB0 thermometer.mcap   (until Ctrl-C)
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from acquisition.recording import Channel as Declared
from acquisition.recording import RecordingWriter
from drivers.clock import Clock, SystemClock
from drivers.device import Block, Channel
from drivers.errors import DeviceLost, DeviceStale, WireError
from drivers.transports.serial_port import SerialAddress, open_serial
from drivers.transports.transport import Transport

BAUD = 9600
STALE_S = 1.0  # it speaks ten times a second
LONGEST = 16  # bytes of a line: nothing that a stranger sends may grow without end


def values_of(line: bytes) -> float:
    """Bytes to a value: degrees Celsius of one line. WireError for anything else."""
    try:
        value = float(line)
    except ValueError:
        value = float("nan")
    if not -100.0 < value < 300.0:
        raise WireError(f"thermometer: {line[:32]!r} is no temperature; is it the right port and baud rate?")
    return value


class Thermometer:
    """A `drivers.device.Device`: one channel, temperature_degC."""

    name = "thermometer"

    def __init__(self, open_line: Callable[[], Transport], clock: Clock | None = None) -> None:
        self._open_line, self._clock = open_line, clock or SystemClock()
        self._line: Transport | None = None
        self._pending, self._count = b"", 0

    def connect(self) -> None:
        """Every call opens the line anew, so a thermometer that was unplugged is found again. DeviceLost."""
        self.close()
        self._line, self._pending = self._open_line(), b""

    def describe(self) -> tuple[Channel, ...]:
        return (Channel("temperature_degC", "degC", resolution=0.01),)

    def read(self, timeout_s: float) -> Block:
        """At least one sample; DeviceStale when none came, DeviceLost when the plug is out, WireError for nonsense."""
        if self._line is None:
            raise DeviceLost(f"{self.name}: not connected")
        until_s = self._clock.now_s() + timeout_s
        while not (values := self._arrived()):
            left_s = until_s - self._clock.now_s()
            if left_s <= 0.0:
                raise DeviceStale(f"{self.name}: no line for {timeout_s:.3g} s; check its plug and power")
            self._pending += self._line.read(256, left_s)
        return self._block(values)

    def close(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            line.close()

    def _arrived(self) -> list[float]:
        *lines, self._pending = self._pending.split(b"\n")
        if len(self._pending) > LONGEST:
            raise WireError(f"{self.name}: {self._pending[:32]!r} has no end; is the baud rate {BAUD}?")
        return [values_of(line) for line in lines if line.strip()]

    def _block(self, values: list[float]) -> Block:
        """It has no clock of its own: `device_s` says so."""
        n = len(values)
        sequence = np.arange(self._count, self._count + n)
        self._count += n
        return Block(
            np.full(n, self._clock.now_s()), np.full(n, np.nan), sequence, {"temperature_degC": np.array(values)}
        )


def record(device: Thermometer, rig: Path, out: Path, samples: float = np.inf) -> None:
    """One recording, readable at any moment, until `samples` are in it or Ctrl-C."""
    clock, kept = SystemClock(), 0
    with RecordingWriter(out, rig_text=rig.read_text(), software="thermometer 1", clock=clock) as writer:
        device.connect()
        declared = tuple(Declared(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in device.describe())
        stream = writer.stream(device.name, declared)
        try:
            while kept < samples:
                block = device.read(STALE_S)
                stream.append(block.host_s, block.device_s, block.sequence, block.values)
                kept += len(block.host_s)
        except KeyboardInterrupt:
            print(f"{out}: {kept} temperatures")
        finally:
            device.close()


if __name__ == "__main__":
    address = SerialAddress(port=sys.argv[2])
    record(Thermometer(lambda: open_serial(address, BAUD)), Path(sys.argv[1]), Path(sys.argv[3]))
