"""A worker's side: hands recordings to a process of its own, and answers for it when it dies or takes too long.

Light on purpose: what loads numpy is the process.
"""

import contextlib
import os
import select
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable

import msgspec

from calibeam.fleet.row import Order, Row, death

START_S = 120.0  # to load all libraries on a busy machine with a cold disk; 1 s as a rule
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "BLIS_NUM_THREADS"), "1"
)
TAIL_BYTES = 4096

_of_thread = threading.local()  # a worker of a Dask cluster may have several threads: each has its own process


def run_in_child(order: Order) -> Row:
    """The row of one recording, whatever it does. Called in a worker."""
    child: Child | None = getattr(_of_thread, "child", None)
    if child is None or child.command != order.command:
        end_child()
        child = _of_thread.child = Child(order.command)
    return child.ask(order)


def end_child() -> None:
    """End the process of this thread, if it has one: without workers, who asked for it decides when."""
    child: Child | None = getattr(_of_thread, "child", None)
    if child is not None:
        child.close()
        del _of_thread.child


class Child:
    """The process, started when it is needed and again after it was lost."""

    def __init__(self, command: tuple[str, ...], clock: Callable[[], float] = time.monotonic) -> None:
        self.command, self._clock = command, clock
        self._process: subprocess.Popen[bytes] | None = None
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - its errors, as long as it lives; an unread pipe would stop it

    def ask(self, order: Order) -> Row:
        """The row of a recording; one that is lost gives the reason."""
        begun_s = self._clock()
        try:
            process = self._started()
            line = self._answer(process, msgspec.json.encode(order.task) + b"\n", order.timeout_s)
            return msgspec.json.decode(line, type=Row)
        except (_Ended, TimeoutError, OSError, msgspec.DecodeError) as why:
            self.end()
            return order.task.lost(str(why), self._clock() - begun_s)

    def end(self) -> None:
        """Kill it and all that it started; safe to call again."""
        process, self._process = self._process, None
        if process is not None:
            if process.poll() is None:  # else its number may be somebody else's by now
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    with contextlib.suppress(OSError):
                        pipe.close()

    def close(self) -> None:
        """End it for good."""
        self.end()
        self._said.close()

    def _started(self) -> "subprocess.Popen[bytes]":
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.end()
        self._said.seek(0)
        self._said.truncate()
        self._process = subprocess.Popen(  # noqa: S603 - our own module, no shell
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            bufsize=0,
            start_new_session=True,  # Ctrl-C is for who asks; it ends with its input
            env={**os.environ, **ONE_THREAD},
        )
        self._line(self._process, START_S)
        return self._process

    def _answer(self, process: "subprocess.Popen[bytes]", task: bytes, timeout_s: float | None) -> bytes:
        assert process.stdin is not None  # noqa: S101 - asked for above
        try:
            process.stdin.write(task)
        except BrokenPipeError:
            raise _Ended(self._how(process)) from None
        return self._line(process, timeout_s)

    def _line(self, process: "subprocess.Popen[bytes]", timeout_s: float | None) -> bytes:
        """One line of its output. _Ended, or TimeoutError."""
        assert process.stdout is not None  # noqa: S101
        until_s = None if timeout_s is None else self._clock() + timeout_s
        read = bytearray()
        while not read.endswith(b"\n"):
            left_s = None if until_s is None else max(0.0, until_s - self._clock())
            if not select.select([process.stdout], [], [], left_s)[0]:
                raise TimeoutError(f"not done after {timeout_s:g} s; give a longer --timeout")
            piece = os.read(process.stdout.fileno(), 1 << 16)
            if not piece:
                raise _Ended(self._how(process))
            read += piece
        return bytes(read)

    def _how(self, process: "subprocess.Popen[bytes]") -> str:
        """How it ended, with its last message."""
        how = death(process.wait())
        size = self._said.seek(0, os.SEEK_END)
        self._said.seek(max(0, size - TAIL_BYTES))
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        return f"{how} ({lines[-1]})" if lines else how


class _Ended(Exception):  # noqa: N818 - an outcome, reported in a row
    """The process is gone."""
