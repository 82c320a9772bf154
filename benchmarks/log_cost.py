"""What `calibeam log encoders` costs: six encoders at 1 kHz, positions and every frame, as a process of its own.

On site the encoders are no program. So the emulated ones get a core for themselves, and the logger another: on one core
they empty each other's caches 2,000 times a second, which costs the logger more than its own work.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from acquisition.recording.read import read
from acquisition.recording.segments import segments

FOR_S = 30.0
RATE_HZ = 1000.0
MARGIN_S = 2.0  # after the beginning and before the end, not measured


def lines(rig: Path, for_s: float = FOR_S) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        yield from _logged(rig, Path(folder), for_s)


@dataclass(frozen=True)
class _Used:
    """Of the logger's process, between two moments at which it logs: starting and ending are not counted."""

    cpu_s: float
    span_s: float
    switches: int
    rss_bytes: int  # grown


def _logged(rig: Path, folder: Path, for_s: float) -> Iterator[str]:
    command = [sys.executable, "-m", "benchmarks.encoder_bus"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as bus:
        assert bus.stdout is not None
        assert bus.stdin is not None
        _place(bus.pid, 0)
        text = rig.read_text().replace('"out/emulated/can" ', f'"{bus.stdout.readline().strip()}" ')
        (folder / "rig.toml").write_text(text.replace("sync_hz = 100.0", f"sync_hz = {RATE_HZ}"))
        command = [sys.executable, "-m", "calibeam", "log", "encoders", str(folder / "rig.toml"), "--json"]
        command += ["--out", str(folder / "log"), "--for-s", str(for_s)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as logger:
            assert logger.stdout is not None
            _place(logger.pid, -1)
            used = _watched(psutil.Process(logger.pid), folder / "log" / "segment-0001.mcap", for_s - 2.0 * MARGIN_S)
            counts = json.loads(logger.stdout.read())
        bus.stdin.close()
    (file,) = segments(folder / "log")
    stream = read(file).streams["encoders"]
    asked = int(stream.sequence[-1] - stream.sequence[0]) + 1
    trip_ms = 1e3 * np.quantile(stream.host_s - stream.device_s, [0.5, 0.99])
    share, rate_hz = counts["rows"] / asked, asked / float(stream.host_s[-1] - stream.host_s[0])
    yield f"{counts['rows']} of {asked} SYNCs have a row ({100.0 * share:.2f} %), {counts['frames']} frames"
    trip = f"SYNC to last answer {trip_ms[0]:.2f} ms in the median, {trip_ms[1]:.2f} ms at 99 %"
    yield f"{trip}; rate {rate_hz:.1f} Hz"
    cost = used.cpu_s / used.span_s
    yield (
        f"processor {used.cpu_s:.2f} s in {used.span_s:.1f} s: {100.0 * cost:.1f} % of one core, "
        f"{1e6 * cost / (share * rate_hz):.0f} us a row; {used.switches / used.span_s:.0f} times a second it waited"
    )
    yield f"memory {used.rss_bytes / 1e6:+.1f} MB meanwhile"
    yield f"{file.stat().st_size / counts['rows']:.0f} bytes a row of six positions and seven frames"


def _watched(logger: psutil.Process, first: Path, for_s: float) -> _Used:
    while not first.exists():
        time.sleep(0.01)
    time.sleep(MARGIN_S)
    before, memory, switches, from_s = logger.cpu_times(), logger.memory_info(), _waits(logger), time.monotonic()
    time.sleep(for_s)
    after, span_s = logger.cpu_times(), time.monotonic() - from_s
    cpu_s = after.user + after.system - before.user - before.system
    return _Used(cpu_s, span_s, _waits(logger) - switches, logger.memory_info().rss - memory.rss)


def _waits(logger: psutil.Process) -> int:
    """Of all its threads; psutil counts those of the first alone."""
    status = (task.joinpath("status").read_text() for task in Path(f"/proc/{logger.pid}/task").glob("*"))
    return sum(int(line.split()[1]) for text in status for line in text.splitlines() if line.startswith("voluntary"))


def _place(pid: int, core: int) -> None:
    """On the first (0) or the last (-1) core, before other programs, where the operating system allows that."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(pid, {sorted(os.sched_getaffinity(0))[core]})
        with suppress(PermissionError):
            os.sched_setscheduler(pid, os.SCHED_RR, os.sched_param(1))
