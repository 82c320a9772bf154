"""A USB plug that is pulled in the middle of a byte stream and put back, under another name, with the same number."""

import os
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import suppress
from types import SimpleNamespace

import pytest

TURN_S = 0.001


class Plug:
    """A pseudo-terminal with an emulated wire behind it. `cut_after` bytes to the client the far end hangs up."""

    def __init__(self, serial_number: str, wire) -> None:
        self.serial_number, self.wire = serial_number, wire
        self.cut_after: int | None = None
        self.cuts = 0
        self.plugged_s = 0.0
        self.master: int | None = None
        self.path = ""
        self.put_in()

    def put_in(self) -> None:
        """Under the name that the system gives now; a placeholder keeps it from being the one of before."""
        placeholder = os.openpty()
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave  # held open until the client has it: closing it now would lose what is written before
        os.set_blocking(self.master, False)
        for fd in placeholder:
            os.close(fd)
        self.plugged_s = time.monotonic()

    def pull(self) -> None:
        if self.master is not None:
            os.close(self.master)
            os.close(self._slave)
        self.master = None
        self.cuts += 1

    def turn(self) -> None:
        """Bytes of the client to the wire and back; pulled when the count is reached, put in again at once."""
        if self.master is None:
            return
        out = self.wire.due()
        with suppress(OSError):  # nothing has come
            out = self.wire.handle(os.read(self.master, 65536)) + out
        if self.cut_after is not None:
            out, whole = out[: self.cut_after], out
            self.cut_after -= len(out)
            self._write(out)
            if len(out) < len(whole) or self.cut_after == 0:
                self.cut_after = None
                self.pull()
                self.put_in()
            return
        self._write(out)

    def _write(self, data: bytes) -> None:
        with suppress(OSError):  # nobody reads
            os.write(self.master, data)


class Workbench:
    """Plugs over one emulated world, run by a thread in real time; what the system lists as ports."""

    def __init__(self, world, instruments, plugs: list[Plug]) -> None:
        self.world, self.instruments, self.plugs = world, instruments, plugs
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def ports(self) -> list[SimpleNamespace]:
        return [SimpleNamespace(device=plug.path, serial_number=plug.serial_number) for plug in self.plugs]

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        for plug in self.plugs:
            plug.pull()

    def _run(self) -> None:
        start_s = time.monotonic() - self.world.time_s
        while not self._stop.wait(TURN_S):
            before_s = self.world.time_s
            self.world.advance(time.monotonic() - start_s)
            for instrument in self.instruments:
                instrument.after_step(before_s)
            for plug in self.plugs:
                plug.turn()


@pytest.fixture
def on_plugs() -> Iterator[Callable[..., Workbench]]:
    """Puts the ports of an emulated bench on plugs with serial numbers."""
    made: list[Workbench] = []

    def put(world, bench, serial_numbers: tuple[str, ...]) -> Workbench:
        plugs = [Plug(number, port.wire) for number, port in zip(serial_numbers, bench.ports, strict=True)]
        made.append(Workbench(world, bench.instruments, plugs))
        return made[-1]

    yield put
    for workbench in made:
        workbench.close()
