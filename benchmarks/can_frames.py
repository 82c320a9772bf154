"""CAN frames through the whole way of a log: bus, tap, recording; every one counted and read back."""

import os
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import numpy as np

from acquisition.recording import RecordingWriter, read
from acquisition.recording.can_frames import DATA, STREAM
from acquisition.recording.rig import rig_text
from acquisition.wires.frame_log import FrameLog
from drivers.clock import SystemClock
from drivers.transports.can_bus import bus_opener, tapped

RATE_HZ = 10_000.0
ON_VIRTUAL, THROUGH_SLCAN = 1_000_000, 20_000
SILENCE_S = 5.0  # no frame for so long: the rest is lost


def lines(rig: Path, on_virtual: int = ON_VIRTUAL, through_slcan: int = THROUGH_SLCAN) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        yield _virtual(rig, Path(folder) / "virtual.mcap", on_virtual)
        yield _slcan(rig, Path(folder) / "slcan.mcap", through_slcan)


def _virtual(rig: Path, path: Path, count: int) -> str:
    """Sender and logger are threads of one process: python-can's `virtual` reaches no further."""
    with can.Bus("benchmark", interface="virtual") as there:
        sender = threading.Thread(target=_send_paced, args=(there, count))
        took_s, cpu_s = _logged(rig, path, "virtual", "benchmark", count, sender.start)
        sender.join()
    speed = f"{count / took_s:.0f} frames/s, sender and logger together {_per(cpu_s, count)}"
    return f"virtual: {_verdict(path, count)}; {speed}"


def _slcan(rig: Path, path: Path, count: int) -> str:
    """The sender is a process of its own, which writes lines as fast as 10,000 frames a second into the terminal."""
    far, near = os.openpty()
    tty.setraw(near)
    command = [sys.executable, "-m", "benchmarks.slcan_source", str(far), str(count), str(RATE_HZ)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, pass_fds=[far]) as source:
        os.close(far)
        assert source.stdin is not None
        go = source.stdin
        took_s, cpu_s = _logged(rig, path, "slcan", os.ttyname(near), count, go.close)
        source.terminate()
    os.close(near)
    return f"slcan: {_verdict(path, count)}; {count / took_s:.0f} frames/s, logger {_per(cpu_s, count)}"


def _logged(
    rig: Path, path: Path, interface: str, channel: str, count: int, begin: Callable[[], object]
) -> tuple[float, float]:
    """Seconds from the first frame to the last, and processor seconds of this process meanwhile."""
    clock = SystemClock()
    with RecordingWriter(path, rig_text=rig_text(rig), software="benchmark", clock=clock) as writer:
        log = FrameLog(writer, clock)
        with tapped(bus_opener(interface, channel, 1_000_000), log.hear)() as bus:
            begin()
            heard = 0
            started_s, cpu_s = time.monotonic(), time.process_time()
            while heard < count and bus.recv(SILENCE_S) is not None:
                heard += 1
            took_s, cpu_s = time.monotonic() - started_s, time.process_time() - cpu_s
        log.flush()
    return took_s, cpu_s


def _send_paced(bus: can.BusABC, count: int) -> None:
    started_s = time.monotonic()
    for number in range(count):
        if number % 50 == 0:
            time.sleep(max(0.0, started_s + number / RATE_HZ - time.monotonic()))
        bus.send(can.Message(arbitration_id=number % 0x7FF, data=struct.pack("<Q", number), is_extended_id=False))


def _verdict(path: Path, count: int) -> str:
    """Compares what the file holds with what was sent."""
    recording = read(path)
    stream = recording.streams[STREAM]
    numbers = stream.values[DATA].astype(np.uint8).view("<u8").ravel().astype(np.int64)
    lost = count - np.unique(numbers).size
    reordered = int(np.count_nonzero(np.diff(numbers) < 0))
    doubled = numbers.size - np.unique(numbers).size
    return f"{count} frames sent, {lost} lost, {reordered} reordered, {doubled} doubled, {len(stream.gaps)} gaps"


def _per(cpu_s: float, count: int) -> str:
    return f"{1e6 * cpu_s / count:.1f} us of processor a frame"
