"""The shipped DBC files, read by cantools' own command line: `decode` of a log, `monitor` on the emulated bus."""

import os
import pty
import select
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from simulators.encoders.emulator import build
from simulators.host.loop import Host

ROOT = Path(__file__).parents[3]
CIA406, PLAIN = ROOT / "rigs/encoders-cia406.dbc", ROOT / "rigs/encoders-plain.dbc"
CANTOOLS = [sys.executable, "-m", "cantools"]
START_S = 60.0  # importing everything on a busy machine


def decoded(dbc: Path, lines: list[str]) -> str:
    found = subprocess.run(
        [*CANTOOLS, "decode", "--single-line", str(dbc)],
        input="\n".join(lines) + "\n",
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
    )
    return found.stdout


def candump(line: str) -> str:
    """A line of the adapter, tIIILDD.., as candump writes it."""
    number, length, data = line[1:4], line[4], line[5:]
    pairs = " ".join(data[at : at + 2] for at in range(0, len(data), 2))
    return f"  can0  {number}   [{length}]  {pairs}"


def test_cantools_decodes_what_the_emulated_bus_says(adapter):
    adapter.open()
    adapter.send("t00020100", "t60182B171000C8000000")
    adapter.send("t0800")
    adapter.bench.verbs["encoders.emergency"](node=2, code=0x7320)
    heard = adapter.run(0.3)
    text = decoded(CIA406, [candump(line) for line in heard])
    assert "Unknown frame id" not in text
    said = [line.split("::")[1].strip() for line in text.splitlines() if "::" in line]
    assert len(said) == len(heard)
    assert "TPDO2_1(Position: 90.0 deg)" in said
    assert "TPDO2_2(Position: -90.0 deg)" in said
    assert "HEARTBEAT1(State: operational)" in said
    assert any(line.startswith("EMCY2(ErrorCode: position error, ErrorRegister: 33, Alarms: 1") for line in said)


class Shafts:
    time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return np.array([np.pi / 2, -np.pi / 2, 0.0, 1.0, 2.0, 3.0])


@pytest.fixture
def plain_channel() -> Iterator[str]:
    signals = [f"ENCODER{n}.Angle" for n in range(1, 7)]
    world = Shafts()
    device = {"driver": "can-dbc", "signals": signals, "channel": "can0", "sync_hz": 20.0}
    host = Host(build(world, {"devices": {"encoders": device}}), world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield host.serial_address("can")
    finally:
        stop.set()
        thread.join()
        host.close()


def test_cantools_monitor_shows_the_emulated_bus(plain_channel):
    command = [*CANTOOLS, "monitor", "-i", "slcan", "-c", plain_channel, "-b", "1000000", str(PLAIN)]
    screen, terminal = pty.openpty()
    environment = os.environ | {"TERM": "linux", "LINES": "50", "COLUMNS": "120"}
    monitor = subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=subprocess.PIPE, env=environment)
    os.close(terminal)
    shown = b""
    until_s = time.monotonic() + START_S
    try:
        while not all(word in shown for word in (b"ENCODER1", b"ENCODER6", b"90.0")) and time.monotonic() < until_s:
            if select.select([screen], [], [], 1.0)[0]:
                try:
                    shown += os.read(screen, 65536)
                except OSError:
                    break  # it has ended
        os.write(screen, b"q")
        assert b"ENCODER1" in shown, (shown[-300:], monitor.poll())
        assert b"90.0" in shown
        assert b"-90.0" in shown
    finally:
        monitor.terminate()
        monitor.communicate(timeout=30)
        os.close(screen)
