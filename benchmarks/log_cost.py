"""What `calibeam log encoders` costs: six encoders at 1 kHz, positions and every frame, as a process of its own.

On site the encoders are no program. So the emulated ones get a core for themselves, and the logger another: on one core
they empty each other's caches 2,000 times a second, which costs the logger more than its own work.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from acquisition.recording.read import read
from acquisition.recording.segments import segments

FOR_S = 30.0
RATE_HZ = 1000.0


def lines(rig: Path, for_s: float = FOR_S) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        yield from _logged(rig, Path(folder), for_s)


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
            said = json.loads(logger.stdout.read())
            _, _, usage = os.wait4(logger.pid, 0)
            logger.returncode = 0
        bus.stdin.close()
    idle_s = _idle_s()
    cpu_s = usage.ru_utime + usage.ru_stime - idle_s
    (file,) = segments(folder / "log")
    stream = read(file).streams["encoders"]
    asked = int(stream.sequence[-1] - stream.sequence[0]) + 1
    span_s = float(stream.host_s[-1] - stream.host_s[0])
    trip_ms = 1e3 * np.quantile(stream.host_s - stream.device_s, [0.5, 0.99])
    share = 100.0 * said["rows"] / asked
    yield f"{said['rows']} of {asked} SYNCs have a row ({share:.2f} %), {said['frames']} frames"
    trip = f"SYNC to last answer {trip_ms[0]:.2f} ms in the median, {trip_ms[1]:.2f} ms at 99 %"
    yield f"{trip}; rate {asked / span_s:.1f} Hz"
    yield (
        f"processor {cpu_s:.2f} s in {span_s:.1f} s: {100.0 * cpu_s / span_s:.1f} % of one core "
        f"({idle_s:.2f} s of starting the program not counted), {1e6 * cpu_s / said['rows']:.0f} us a row"
    )
    yield f"{file.stat().st_size / said['rows']:.0f} bytes a row of six positions and seven frames"


def _place(pid: int, core: int) -> None:
    """On the first (0) or the last (-1) of the cores that there are, where the operating system can do that."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(pid, {sorted(os.sched_getaffinity(0))[core]})


def _idle_s() -> float:
    """Processor time of starting the program and ending it at once."""
    with subprocess.Popen([sys.executable, "-m", "calibeam", "--version"], stdout=subprocess.DEVNULL) as program:
        _, _, usage = os.wait4(program.pid, 0)
        program.returncode = 0
    return usage.ru_utime + usage.ru_stime
