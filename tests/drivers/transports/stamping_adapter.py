"""The emulated plain encoders behind their serial adapter, on a pseudo-terminal whose time the test steps."""

import os
import threading
import tty
from contextlib import suppress

import numpy as np

from drivers.transports.slcan_stamps import MinuteClock, StampedSlcanBus
from simulators.encoders.emulator import build
from simulators.wire import TICK_S

SIGNALS = [f"ENCODER{n}.Angle" for n in range(1, 7)]
START_RAD = np.array([0.0, -1.0, 2.0, -3.0, 4.0, 100.0])
SPEED_RAD_S = 0.5


class Shafts:
    """Six shafts at half a radian a second of the test's time."""

    def __init__(self, time_s: float) -> None:
        self.time_s = time_s

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return START_RAD + SPEED_RAD_S * self.time_s


class StampingAdapter:
    """Commands are answered by a thread, `refused` by BEL; frames come when the test lets time pass, all at once."""

    def __init__(self, time_s: float = 0.0, *, refused: bytes = b"-") -> None:
        self.world = Shafts(time_s)
        device = {"driver": "can-dbc", "signals": SIGNALS, "sync_hz": 100.0, "channel": "can0"}
        self._bench = build(self.world, {"devices": {"encoders": device}})
        self._wire, self._refused = self._bench.ports[0].wire, refused
        self.commands = b""
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        self.channel = os.ttyname(self._near)
        self._answering = threading.Thread(target=self._answer)
        self._answering.start()

    def open(self) -> StampedSlcanBus:
        """The bus, when the adapter has taken all of its commands."""
        bus = StampedSlcanBus(self.channel, MinuteClock(), bitrate=1_000_000, sleep_after_open=0.0)
        assert bus.get_version(10.0) == (10, 13)
        return bus

    def run(self, seconds: float) -> None:
        came = b""
        for _ in range(round(seconds / TICK_S)):
            t_s = self.world.time_s
            self.world.advance(round(t_s + TICK_S, 9))
            for instrument in self._bench.instruments:
                instrument.after_step(t_s)
            came += self._wire.due()
        self.say(came)

    def say(self, data: bytes) -> None:
        assert os.write(self._far, data) == len(data)

    def close(self) -> None:
        """When everything that was written has been taken."""
        os.close(self._near)  # the last of this side: the thread reads what is left, and then the end
        self._answering.join()
        os.close(self._far)

    def _answer(self) -> None:
        with suppress(OSError):  # EIO: nobody has the terminal open any more
            while data := os.read(self._far, 4096):
                self.commands += data
                self.say(self._wire.handle(data.replace(self._refused, b"?")))
