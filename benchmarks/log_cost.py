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

from acquisition.recording import read
from acquisition.recording.mcap import segments

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
            used = _watched(logger.pid, folder / "log" / "segment-0001.mcap", for_s - 2.0 * MARGIN_S)
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


def _watched(pid: int, first: Path, for_s: float) -> _Used:
    while not first.exists():
        time.sleep(0.01)
    time.sleep(MARGIN_S)
    before, from_s = _so_far(pid), time.monotonic()
    time.sleep(for_s)
    after, span_s = _so_far(pid), time.monotonic() - from_s
    cpu_s, switches, rss_bytes = (end - begin for end, begin in zip(after, before, strict=True))
    return _Used(cpu_s, span_s, int(switches), int(rss_bytes))


def _so_far(pid: int) -> tuple[float, float, float]:
    """Processor seconds, waits of all threads, bytes in memory (Linux, proc(5))."""
    process = Path(f"/proc/{pid}")
    user, system = (process / "stat").read_text().rpartition(")")[2].split()[11:13]
    lines = [line for task in process.glob("task/*/status") for line in task.read_text().splitlines()]
    switches = sum(int(line.split()[1]) for line in lines if line.startswith("voluntary"))
    pages = int((process / "statm").read_text().split()[1])
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK"), switches, pages * os.sysconf("SC_PAGE_SIZE")


def _place(pid: int, core: int) -> None:
    """On the first (0) or the last (-1) core, before other programs, where the operating system allows that."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(pid, {sorted(os.sched_getaffinity(0))[core]})
        with suppress(PermissionError):
            os.sched_setscheduler(pid, os.SCHED_RR, os.sched_param(1))
