"""kill -9 at random moments of a recording at full rate: how much is lost, and that the rest is always readable."""

import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from acquisition.recording import read, recover

KILLS = 100
SEED = 1
BOUND_S = 0.1  # what may be lost, and one batch

RECORDER = """
import os, sys, time
import numpy as np
from acquisition.recording.recording import Channel
from acquisition.recording.mcap.writer import RecordingWriter
from drivers.clock import SystemClock

clock = SystemClock()
writer = RecordingWriter(sys.argv[1], rig_text=open(sys.argv[2]).read(), software="benchmark", clock=clock)
psd = writer.stream("psd", (Channel("number", ""), Channel("spot_m", "m", (4,))))
encoders = writer.stream("encoders", (Channel("number", ""), Channel("position_rad", "rad", (6,))))
rng, number, due_s = np.random.default_rng(0), 0, clock.now_s()
while True:
    block, now_s = np.arange(number, number + 20), clock.now_s()
    times_s = now_s - 0.001 * np.arange(19, -1, -1)
    psd.append(times_s, times_s, block, {"number": block, "spot_m": rng.normal(size=(20, 4))})
    encoders.append(times_s, times_s, block, {"number": block, "position_rad": rng.normal(size=(20, 6))})
    number += 20
    os.write(1, np.array([now_s, number], dtype="<f8").tobytes())
    due_s += 0.02
    clock.sleep_s(max(0.0, due_s - clock.now_s()))
"""


def lines(rig: Path, kills: int = KILLS) -> Iterator[str]:
    rng = np.random.default_rng(SEED)
    lost_s: list[float] = []
    wrong = unreadable = not_recovered = 0
    for after_s in rng.uniform(0.2, 1.2, kills):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "killed.mcap"
            last_s, number = _killed(rig, path, float(after_s))
            try:
                streams = read(path).streams
                not_recovered += recover(path, Path(folder) / "recovered.mcap").messages == 0
            except Exception:  # whatever it was, it is what is counted here
                unreadable += 1
                continue
            for stream in streams.values():
                whole = np.array_equal(stream.values["number"], np.arange(stream.host_s.size))
                wrong += not whole or stream.host_s.size > number
            lost_s.append(last_s - min(float(stream.host_s[-1]) for stream in streams.values()))
    yield (
        f"{kills} kills -9 at random moments, two streams of 1 kHz: {unreadable} unreadable, "
        f"{wrong} streams with a wrong sample"
    )
    yield (
        f"lost: {1e3 * np.median(lost_s):.0f} ms in the median, {1e3 * max(lost_s):.0f} ms at most; bound "
        f"{1e3 * BOUND_S:.0f} ms and one batch; beyond it {sum(lost > BOUND_S + 0.02 for lost in lost_s)} times; "
        f"{not_recovered} not recovered"
    )


def _killed(rig: Path, path: Path, after_s: float) -> tuple[float, int]:
    """Host time and number of the last sample that was handed over before the kill."""
    command = [sys.executable, "-c", RECORDER, str(path), str(rig)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        descriptor, said, end_s = child.stdout.fileno(), b"", float("inf")
        while time.monotonic() < end_s:
            left_s = min(30.0, end_s - time.monotonic())
            if select.select([descriptor], [], [], max(0.0, left_s))[0]:
                said += os.read(descriptor, 65536)
            if said and end_s == float("inf"):
                end_s = time.monotonic() + after_s
        child.send_signal(signal.SIGKILL)
        said += child.stdout.read()
    received = np.frombuffer(said[: len(said) // 16 * 16], dtype="<f8").reshape(-1, 2)
    return float(received[-1, 0]), int(received[-1, 1])
