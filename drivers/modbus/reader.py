"""Recorder of a controller over Modbus: polls the register map at a fixed rate; it never moves anything.

Modbus sends no time stamps: the device time of a sample is the host's, in the middle between question and answer. What
was not polled in time is a gap in `sequence`. Values that no longer change cannot be separated from an arm that stands,
unless the map has a `life` register: then a controller whose program has stopped is stale.
"""

import math

import numpy as np

from drivers.clock import Clock, SystemClock
from drivers.device import Block, Channel, Floats, Stamps
from drivers.errors import DeviceStale
from drivers.modbus.line import ModbusLine
from drivers.modbus.register_map import JOINTS, LIFE, RegisterMap

LIFE_LIMIT_S = 0.5  # without a count; programs count every cycle, some milliseconds
TORN_RAD = math.pi  # no joint turns by half a turn between two polls: angle and turn were not of one moment


class ModbusReader:
    """A `Device`. `line` may be shared with whoever moves the arm."""

    stamps: Stamps = "sent"

    def __init__(
        self,
        line: ModbusLine,
        registers: RegisterMap,
        rate_hz: float = 50.0,
        *,
        name: str = "robot",
        clock: Clock | None = None,
    ) -> None:
        self.name = name
        self._line, self._map, self._rate_hz = line, registers, rate_hz
        self._clock: Clock = clock or SystemClock()
        self._channels = registers.readings
        self._requests = registers.requests([channel.name for channel in self._channels])
        self._start_s: float | None = None
        self._slot = -1
        self._q_rad: Floats | None = None
        self._life: tuple[float, float] = (math.nan, 0.0)  # its count, and since when

    def connect(self) -> None:
        """Reads once, so that a map that does not fit is reported at once. DeviceLost, DeviceStale, DeviceRefused."""
        self._line.connect()
        self._start_s, self._slot, self._q_rad = None, -1, None
        self._life = (math.nan, self._clock.now_s())
        self._poll()

    def describe(self) -> tuple[Channel, ...]:
        return self._channels

    def read(self, timeout_s: float) -> Block:
        """The next sample, when it is due. DeviceLost, DeviceRefused; DeviceStale also when `life` stands still."""
        self._wait_for_slot()
        values, at_s = self._poll()
        self._check_life(values, at_s)
        return Block(
            host_s=np.array([self._clock.now_s()]),
            device_s=np.array([at_s]),
            sequence=np.array([self._slot]),
            values={channel.name: _shaped(values[channel.name], channel) for channel in self._channels},
        )

    def close(self) -> None:
        self._line.close()

    def _wait_for_slot(self) -> None:
        """The next whole period since the first sample; those that passed while nobody read are left out."""
        now_s = self._clock.now_s()
        if self._start_s is None:
            self._start_s, self._slot = now_s, 0
            return
        self._slot = max(self._slot + 1, math.floor((now_s - self._start_s) * self._rate_hz))
        wait_s = self._start_s + self._slot / self._rate_hz - now_s
        if wait_s > 0.0:
            self._clock.sleep_s(wait_s)

    def _poll(self) -> tuple[dict[str, Floats], float]:
        values, at_s = self._poll_once()
        if self._q_rad is not None and np.abs(values[JOINTS] - self._q_rad).max() > TORN_RAD:
            values, at_s = self._poll_once()
        self._q_rad = values[JOINTS]
        return values, at_s

    def _poll_once(self) -> tuple[dict[str, Floats], float]:
        before_s = self._clock.now_s()
        words: dict[tuple[str, int], int] = {}
        for request in self._requests:
            raw = self._line.read(request.table, request.address, request.count)
            words.update({(request.table, request.address + index): word for index, word in enumerate(raw)})
        at_s = 0.5 * (before_s + self._clock.now_s())
        return {channel.name: self._map.decode(channel.name, words) for channel in self._channels}, at_s

    def _check_life(self, values: dict[str, Floats], at_s: float) -> None:
        if LIFE not in values:
            return
        count, since_s = float(values[LIFE][0]), self._life[1]
        if count != self._life[0]:
            self._life = (count, at_s)
        elif at_s - since_s > LIFE_LIMIT_S:
            raise DeviceStale(
                f"{self._line.place}: its life register stands at {count:.0f} for {at_s - since_s:.2f} s; "
                "the controller's program has stopped: start it"
            )


def _shaped(values: Floats, channel: Channel) -> Floats:
    return values.reshape(1, *channel.shape)
