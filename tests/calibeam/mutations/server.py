"""Runs calibeam's command line in forks of one process that has loaded everything: 0.1 s instead of 3 s a run.

As a module it is that process: a JSON line in, {"words", "folder", "limit_s", "limit_bytes"}, a JSON line out, a `Ran`.
A fork gets no keyboard, its own process group and no network but loopback. It shares no thread with its parent, which
has none; test_mutations.py compares it with the installed console script.
"""

import gc
import json
import os
import resource
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Any, Self

ROOT = Path(__file__).parents[3]
LOOK_S = 0.05  # between two looks at a run: what grows by 1 GB takes longer
TICKS = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = resource.getpagesize()
FILE_BYTES = 1 << 30  # the largest file that a run may write
LAZY = (  # loaded by commands when they need them; here once for all
    "calibeam.results.session_results",
    "calibrate.report.error_simulation_page",
    "calibeam.fleet.fleet_page",
    "calibeam.fleet.run",
    "calibeam.live.devices",
    "calibeam.live.page",
    "calibeam.motion.by_hand",
    "calibeam.motion.examples",
    "calibeam.motion.figures",
    "calibeam.printing.design",
    "calibeam.motion.reachable_poses",
    "calibrate.error_simulation.simulate",
    "calibrate.pose_design.design",
    "calibrate.report.pose_design_page",
    "acquisition.centring.camera.measuring",
    "calibeam.fleet.table",
    "simulators.encoders.emulator",
    "simulators.psd_daq.emulator",
    "simulators.serve",
    "simulators.ur.emulator",
    "encodings.cp1252",
    "encodings.idna",
    "pyarrow.compute",
    "pyarrow.dataset",
)


@dataclass(frozen=True)
class Ran:
    """How one run ended. `code` is negative for a signal, as in subprocess."""

    code: int
    out: str
    err: str
    seconds: float
    cpu_s: float
    peak_bytes: int
    killed: str = ""  # why the server ended it, empty where it ended by itself


class Server:
    """The process, as its client has it. `folder` is where the inputs were made."""

    def __init__(self, folder: Path) -> None:
        command = [sys.executable, "-m", "tests.calibeam.mutations.server", str(folder)]
        self._process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self._answer()

    def run(self, words: list[str], folder: Path, limit_s: float, limit_bytes: int) -> Ran:
        request = {"words": words, "folder": str(folder), "limit_s": limit_s, "limit_bytes": limit_bytes}
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return Ran(**self._answer())

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the server has ended: {self._process.communicate()[1][-2000:]}")
        return json.loads(line)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._process.communicate()  # closes its input, which ends it


def serve(folder: Path) -> None:
    from calibeam.cli import run
    from calibeam.command_list import COMMANDS
    from tests.calibeam.mutations.inputs import write_inputs

    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what is printed while inputs are made is no answer
    for place in COMMANDS.values():
        import_module(f"calibeam.commands.{place.partition(':')[0]}")
    for name in LAZY:
        import_module(name)
    write_inputs(folder, run)
    if threading.active_count() > 1:
        raise RuntimeError(f"threads that a fork would not have: {threading.enumerate()}")
    gc.collect()
    gc.freeze()  # a collection in a fork would copy every page that it looks at
    print("{}", file=answers)
    for line in sys.stdin:
        request = json.loads(line)
        ran = forked(request["words"], Path(request["folder"]), request["limit_s"], request["limit_bytes"])
        print(json.dumps(asdict(ran)), file=answers)


def forked(words: list[str], folder: Path, limit_s: float, limit_bytes: int) -> Ran:
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        began_s = time.monotonic()
        pid = os.fork()
        if pid == 0:
            _become(words, folder, out.fileno(), err.fileno())
        killed = watched(pid, limit_s, limit_bytes)
        _, status, usage = os.wait4(pid, 0)
        _end_group(pid)  # processes that it has started and left
        for file in (out, err):
            file.seek(0)
        texts = [file.read().decode("utf-8", "replace") for file in (out, err)]
    code = os.waitstatus_to_exitcode(status)
    cpu_s = usage.ru_utime + usage.ru_stime
    return Ran(code, *texts, time.monotonic() - began_s, cpu_s, 1024 * usage.ru_maxrss, killed)


def _become(words: list[str], folder: Path, out: int, err: int) -> None:
    """The child: ends the process."""
    code = 70
    try:
        os.setsid()
        os.chdir(folder)
        for source, target in ((os.open(os.devnull, os.O_RDONLY), 0), (out, 1), (err, 2)):
            os.dup2(source, target)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
        sys.addaudithook(_loopback_only)
        sys.argv = ["calibeam", *words]
        from calibeam.cli import main

        try:
            main()
        except SystemExit as ending:
            code = ending.code if isinstance(ending.code, int) else 1
        except BaseException:
            traceback.print_exc()
            code = 1
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _loopback_only(event: str, arguments: tuple[Any, ...]) -> None:
    """Audit hook: an address that a mutation made up is nobody's."""
    if event == "socket.connect" and isinstance(arguments[1], tuple):
        host = str(arguments[1][0])
    elif event == "socket.getaddrinfo":
        host = str(arguments[0] or "localhost")
    else:
        return
    if not (host.startswith("127.") or host in ("::1", "localhost", "0.0.0.0")):
        raise OSError(f"{host[:80]}: no network in this test")


def watched(pid: int, limit_s: float, limit_bytes: int) -> str:
    """Waits for the end, and why it had to be forced. A fork begins with its parent's memory: that counts.

    The limit holds for the time that it computes and for the time that it waits; waiting for a processor that others
    hold (Documentation/scheduler/sched-stats.rst, /proc/PID/schedstat) is neither.
    """
    ended, began_s = os.pidfd_open(pid), time.monotonic()
    try:
        while not select.select([ended], [], [], LOOK_S)[0]:
            held_bytes = int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_BYTES
            user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
            held_up_s = int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) * 1e-9
            computed_s = (int(user) + int(system)) / TICKS
            waited_s = time.monotonic() - began_s - computed_s - held_up_s
            late = max(computed_s, waited_s) > limit_s
            if late or held_bytes > limit_bytes:
                os.kill(pid, signal.SIGKILL)
                return "took too long" if late else f"took {held_bytes / 1e6:.0f} MB"
    finally:
        os.close(ended)
    return ""


def _end_group(group: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
