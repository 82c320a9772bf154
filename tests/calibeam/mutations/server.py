"""Runs calibeam's command line in forks of one process that has loaded everything: 0.1 s instead of 3 s a run.

As a module it is that process: a JSON line in, {"words", "folder", "limit_s", "limit_bytes"}, a JSON line out, a `Ran`.
A fork gets no keyboard, its own process group and no network but loopback. It shares no thread with its parent, which
has none; test_mutations.py compares it with the installed console script. Several runs may be asked of one fork, one
after the other: starting and ending one costs as much as a small command.
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
from dataclasses import asdict, dataclass, replace
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
    "calibrate.design.design",
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
        return self.run_in_turn(words, [folder], limit_s, limit_bytes)[0]

    def run_in_turn(self, words: list[str], folders: list[Path], limit_s: float, limit_bytes: int) -> list[Ran]:
        """In one process. It ends with the first run that does not come to its end: those after it are missing.

        The limits are those of all together; `peak_bytes` is the most until then.
        """
        request = {"words": words, "folders": list(map(str, folders)), "limit_s": limit_s, "limit_bytes": limit_bytes}
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return [Ran(**one) for one in self._answer()["runs"]]

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
        runs = forked(request["words"], request["folders"], request["limit_s"], request["limit_bytes"])
        print(json.dumps({"runs": [asdict(ran) for ran in runs]}), file=answers)


def forked(words: list[str], folders: list[str], limit_s: float, limit_bytes: int) -> list[Ran]:
    with tempfile.TemporaryDirectory() as said:
        began_s = time.monotonic()
        pid = os.fork()
        if pid == 0:
            _become(words, folders, Path(said))
        killed = watched(pid, limit_s, limit_bytes)
        _, status, usage = os.wait4(pid, 0)
        _end_group(pid)  # processes that it has started and left
        code, seconds = os.waitstatus_to_exitcode(status), time.monotonic() - began_s
        whole = Ran(code, "", "", seconds, usage.ru_utime + usage.ru_stime, 1024 * usage.ru_maxrss, killed)
        runs: list[Ran] = []
        for number in range(len(folders)):
            if not (out := Path(said, f"{number}.out")).exists():
                break
            texts = [path.read_text("utf-8", "replace") for path in (out, out.with_suffix(".err"))]
            own = _own(out.with_suffix(".json"), whole)
            runs.append(replace(own, out=texts[0], err=texts[1]))
        return runs or [whole]


def _own(ended: Path, whole: Ran) -> Ran:
    """What a run has left of itself, or where it did not come to its end, what there is of the process."""
    return replace(whole, **json.loads(ended.read_text())) if ended.exists() else whole


def _become(words: list[str], folders: list[str], said: Path) -> None:
    """The child: ends the process, with the exit code of its last run."""
    code = 70
    try:
        os.setsid()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
        sys.addaudithook(_loopback_only)
        sys.argv = ["calibeam", *words]
        for number, folder in enumerate(folders):
            os.chdir(folder)
            for suffix, target in (("out", 1), ("err", 2)):
                file = os.open(said / f"{number}.{suffix}", os.O_CREAT | os.O_WRONLY | os.O_APPEND, 0o600)
                os.dup2(file, target)
                os.close(file)
            began_s, before_s = time.monotonic(), _cpu_s()
            code = _ended()
            ran = {"code": code, "seconds": time.monotonic() - began_s, "cpu_s": _cpu_s() - before_s, "killed": ""}
            ran["peak_bytes"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            (said / f"{number}.json").write_text(json.dumps(ran))
    finally:
        os._exit(code)


def _ended() -> int:
    """The exit code of one run of the command line."""
    from calibeam.cli import main

    code = 0
    try:
        main()
    except SystemExit as ending:
        code = ending.code if isinstance(ending.code, int) else 1
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _cpu_s() -> float:
    """Of this process and of those that it has started."""
    return sum(os.times()[:4])


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
