"""A line-based measuring instrument as a device: a stream of positions of its target, in SI units.

One thread uses it at a time, except `close`, which any thread may call. It starts no thread of its own.
"""

import math
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from drivers.clock import Clock
from drivers.device import Block, Channel, StreamDevice
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.tracker.codec import FARTHEST_M, BadLine, LineCodec, Parse, TargetReading
from drivers.transports.transport import Transport

FIRST_LINE_S = 2.0  # after the connection; a stream of 1 Hz has one by then
HEADER_LINES = 20  # lines that cannot be read, before the first reading; some exporters begin with a heading
WRITE_S = 1.0
READ_BYTES = 65536
SLOWEST_HZ = 5.0  # a reader calls a device silent after 0.5 s


@dataclass(frozen=True)
class Dialogue:
    """What is written to the instrument: once at the start and the end, and before every reading; nothing: b""."""

    start: bytes = b""
    stop: bytes = b""
    trigger: bytes = b""


class LineTracker(StreamDevice[Transport]):
    """A `drivers.device.Device`. Channels: position_m (3,), NaN where the status is bad; good; temperature_degC.

    `open_line` is called by every `connect`. `whole_lines`: the line cannot be joined in the middle of one (datagrams).
    """

    def __init__(
        self,
        open_line: Callable[[], Transport],
        parse: Parse,
        rate_hz: float,
        *,
        dialogue: Dialogue | None = None,
        whole_lines: bool = False,
        temperature: bool = False,
        name: str = "tracker",
        clock: Clock | None = None,
    ) -> None:
        """`rate_hz`: of its stream, or how often it is triggered. ValueError: too slow to notice silence."""
        if not rate_hz >= SLOWEST_HZ:
            raise ValueError(
                f"{name}: rate_hz {rate_hz:g}; a stream below {SLOWEST_HZ:g} Hz counts as silent, let it measure "
                "continuously"
            )
        super().__init__(name, clock)
        self._open_line, self._parse, self._period_s = open_line, parse, 1.0 / rate_hz
        self._dialogue = dialogue or Dialogue()
        self._midway = not (whole_lines or self._dialogue.trigger)
        self._temperature = temperature
        self._reset()

    def _reset(self) -> None:
        self._codec = LineCodec(self._parse, midway=self._midway)
        self._pending: list[tuple[float, int, TargetReading]] = []  # host time of arrival, number, reading
        self._next = 0  # number of the next line; a refused one leaves a gap
        self._awaiting = False  # an answer to a trigger
        self._due_s = -math.inf  # host time of the next trigger
        self.bad_lines = 0
        self.last_bad: BadLine | None = None

    def _open(self) -> Transport:
        with self._named():
            return self._open_line()

    @contextmanager
    def _named(self) -> Generator[None]:
        """A line that is lost is that of this instrument."""
        try:
            yield
        except DeviceLost as lost:
            raise DeviceLost(f"{self.name}: {lost}") from lost

    def _set_up(self, line: Transport) -> None:
        """The first line shows whether the right instrument is there. DeviceStale, DeviceRefused, DeviceLost."""
        self._reset()
        if self._dialogue.start:
            with self._named():
                line.write(self._dialogue.start, WRITE_S)
        deadline_s = self._clock.now_s() + FIRST_LINE_S
        while not self._pending and self.bad_lines < HEADER_LINES and (left_s := self._left_s(deadline_s)) > 0.0:
            self._receive(left_s)
        if self._pending:
            self.stamps = "sampled" if math.isfinite(self._pending[0][2].device_s) else "arrived"
            return
        if self.last_bad is not None:
            raise DeviceRefused(
                f"{self.name}: what is at {line.name} does not print the declared lines: {_shown(self.last_bad)}; "
                "compare columns, separator and units in [devices.tracker] with its output"
            )
        raise DeviceStale(
            f"{self.name}: no line within {FIRST_LINE_S:g} s at {line.name}; check that its output is switched on and "
            "that it sees the target"
        )

    def _release(self, line: Transport) -> None:
        try:
            if self._dialogue.stop:
                line.write(self._dialogue.stop, WRITE_S)
        except DeviceLost:
            pass  # what has gone sends no more
        finally:
            line.close()

    def describe(self) -> tuple[Channel, ...]:
        own = (Channel("position_m", "m", (3,), FARTHEST_M), Channel("good", ""))
        return (*own, Channel("temperature_degC", "degC")) if self._temperature else own

    def read(self, timeout_s: float) -> Block:
        """By the protocol; WireError where lines came and none could be read."""
        deadline_s = self._clock.now_s() + timeout_s
        refused_before = self.bad_lines
        while not self._pending:
            left_s = self._left_s(deadline_s)
            if left_s <= 0.0:
                self._awaiting = False
                raise self._no_samples(timeout_s, refused_before)
            self._receive(left_s)
        arrived, self._pending = self._pending, []
        readings = [reading for _, _, reading in arrived]
        values = {
            "position_m": np.array([reading.position_m for reading in readings]),
            "good": np.array([float(reading.good) for reading in readings]),
        }
        if self._temperature:
            values["temperature_degC"] = np.array([reading.temperature_degC for reading in readings])
        return Block(
            np.array([host_s for host_s, _, _ in arrived]),
            np.array([reading.device_s for reading in readings]),
            np.array([number for _, number, _ in arrived], dtype=np.int64),
            values,
        )

    def _receive(self, timeout_s: float) -> None:
        line = self._opened()
        if self._dialogue.trigger and not self._awaiting:
            wait_s = self._due_s - self._clock.now_s()
            if wait_s > 0.0:
                self._clock.sleep_s(min(wait_s, timeout_s))
                if wait_s >= timeout_s:
                    return
            with self._named():
                line.write(self._dialogue.trigger, WRITE_S)
            self._awaiting, self._due_s = True, self._clock.now_s() + self._period_s
        with self._named():
            data = line.read(READ_BYTES, timeout_s)
        host_s = self._clock.now_s()
        for found in self._codec.feed(data):
            self._awaiting = False
            if isinstance(found, BadLine):
                self.bad_lines += 1
                self.last_bad = found
            else:
                self._pending.append((host_s, self._next, found))
            self._next += 1

    def _no_samples(self, timeout_s: float, refused_before: int) -> DeviceStale | WireError:
        where, refused = self._opened().name, self.bad_lines - refused_before
        if refused and self.last_bad is not None:
            return WireError(
                f"{self.name}: {refused} lines that cannot be read and no reading within {timeout_s:g} s at {where}; "
                f"the last: {_shown(self.last_bad)}; compare [devices.tracker] of the rig file with its output"
            )
        return DeviceStale(
            f"{self.name}: no line within {timeout_s:g} s at {where}; check power, cable and that it sees the target"
        )


def _shown(bad: BadLine) -> str:
    return f"{bad.reason} (byte {bad.offset}: {bad.first!r})"
