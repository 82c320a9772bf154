"""One KPA101 on its line: who it is, one reading at a time.

A reply does not name the request that it answers. So after a reply that did not come in time the line is uncertain: the
next reading waits behind a question of another kind, whose answer proves that everything before it has been heard.
"""

from collections.abc import Callable
from typing import TypeVar

from drivers.clock import Clock
from drivers.device import StreamDevice
from drivers.errors import DeviceRefused, DeviceStale
from drivers.psd_kpa101.codec import Kpa101Codec
from drivers.psd_kpa101.messages import (
    Fault,
    Info,
    Message,
    Mode,
    ModeIs,
    Readings,
    Request,
    RequestInfo,
    RequestMode,
    RequestReadings,
    SetMode,
    StopUpdates,
    StrayBytes,
)
from drivers.transports.transport import Transport

ANSWER_S = 1.0  # a unit answers within some ms; the rest is for a busy host
WRITE_S = 1.0
QUIET_S = 0.003  # 35 byte times at 115200 baud: no message has such a pause inside
READ_BYTES = 4096
Answer = TypeVar("Answer", Info, ModeIs, Readings)


class Kpa101Unit(StreamDevice[Transport]):
    """Opened by `connect`. DeviceLost, DeviceStale, DeviceRefused as every instrument raises them."""

    def __init__(self, name: str, open_line: Callable[[], Transport], clock: Clock) -> None:
        super().__init__(name, clock)
        self.info: Info | None = None
        self.junk_count = 0
        self.last_junk: StrayBytes | None = None
        self._open_line = open_line
        self._codec = Kpa101Codec()
        self._uncertain = False
        self._heard: list[Message] = []

    def identify(self) -> Info:
        """Connect, and report who is there: in monitor mode, quiet unless asked."""
        self.connect()
        assert self.info is not None  # noqa: S101 - asked for by `connect`
        return self.info

    def _open(self) -> Transport:
        return self._open_line()

    def _set_up(self, line: Transport) -> None:
        self._codec = Kpa101Codec()
        self.junk_count, self.last_junk, self._uncertain = 0, None, False
        self._write(StopUpdates())
        info = self.info = self.ask(RequestInfo(), Info)
        self._write(SetMode(Mode.MONITOR))
        mode = self.ask(RequestMode(), ModeIs).mode
        if mode != Mode.MONITOR:
            raise DeviceRefused(
                f"{self.name}: {info.model} {info.serial_number} stays in mode {mode}, not monitor (1); "
                "does another program hold it in closed loop?"
            )

    def ask(self, request: Request, kind: type[Answer]) -> Answer:
        self._write(request)
        answer = self._await(kind, self._clock.now_s() + ANSWER_S)
        if answer is None:
            self._uncertain = True
            raise DeviceStale(
                f"{self.name}: no answer to {type(request).__name__} within {ANSWER_S:g} s at {self._opened().name}; "
                f"check power and cable, and that the port is a KPA101{self._evidence()}"
            )
        return answer

    def request(self, deadline_s: float) -> bool:
        """Ask for a reading, to be fetched by `fetch`. False when the line could not be cleared in time."""
        self._heard.clear()
        if self._uncertain:
            self._write(RequestMode())
            if self._await(ModeIs, deadline_s) is None:
                return False
        self._uncertain = True  # until it is fetched
        self._write(RequestReadings())
        return True

    def fetch(self, deadline_s: float) -> Readings | None:
        """The reading asked for; None when it did not come by `deadline_s` of host time."""
        readings = self._await(Readings, deadline_s)
        self._uncertain = readings is None
        return readings

    def _release(self, line: Transport) -> None:
        line.close()

    def _write(self, request: Request) -> None:
        self._opened().write(self._codec.encode(request), WRITE_S)

    def _await(self, kind: type[Answer], deadline_s: float) -> Answer | None:
        while True:
            for place, message in enumerate(self._heard):
                if isinstance(message, kind):
                    del self._heard[: place + 1]
                    return message
                if isinstance(message, Fault):
                    self._heard.clear()
                    raise DeviceRefused(
                        f"{self.name}: refused message 0x{message.message:04X}, code {message.code}: "
                        f"{message.text or 'no reason given'}"
                    )
            self._heard.clear()
            left_s = self._left_s(deadline_s)
            if left_s <= 0.0:
                return None
            self._listen(left_s)

    def _listen(self, left_s: float) -> None:
        waits_s = min(left_s, QUIET_S) if self._codec.undecided else left_s
        data = self._opened().read(READ_BYTES, waits_s)
        messages = self._codec.feed(data) if data else self._codec.settle()
        for message in messages:
            if isinstance(message, StrayBytes):
                self.junk_count += 1
                self.last_junk = message
            else:
                self._heard.append(message)

    def _evidence(self) -> str:
        return f"; it sent {self.last_junk.first.hex(' ')}" if self.last_junk is not None else ""
