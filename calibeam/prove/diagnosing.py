"""Hands recordings to diagnosing processes that know nothing else: a bare environment, no key, no path to a seal."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from acquisition.recording import read
from calibeam.devices.recorder import uninterrupted
from calibeam.prove.seal import Layout

KEPT = ("PATH", "HOME", "PYTHONPATH", "LANG", "SYSTEMROOT")  # of the environment; nothing in them is about a case
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Answered:
    """How a diagnosis went; its content is in the answer's folder."""

    name: str
    cpu_s: float
    error: str  # empty where it went well


def bare_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """What a diagnosing process gets of it: enough to start Python, nothing that leads to a seal."""
    return {name: environment[name] for name in KEPT if name in environment} | ONE_THREAD


class Blind:
    """One diagnosing process, at work in a folder that holds answers only. Owner of the child; `close` ends it."""

    def __init__(self, folder: Path, without: Sequence[str] = ()) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._child = subprocess.Popen(  # noqa: S603 - our own interpreter; the names are checked against the catalogue
            [sys.executable, "-m", "calibeam.prove.blind", *without],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=bare_environment(os.environ),
            cwd=folder,
            start_new_session=True,  # Ctrl-C is for the process that asks; this one ends with its input
        )

    def answer(self, layout: Layout, name: str) -> Answered:
        """Waits for one diagnosis."""
        order = {
            "recording": str(layout.recording(name).absolute()),
            "asked": str(layout.asked(name).absolute()),
            "out": str(layout.answer(name).absolute()),
            "simulation": str(layout.simulation(name).absolute()),
        }
        stdin, stdout = self._child.stdin, self._child.stdout
        if stdin is None or stdout is None:
            raise RuntimeError("the diagnosing process has no pipes")
        line = ""
        with suppress(BrokenPipeError):
            stdin.write(json.dumps(order) + "\n")
            stdin.flush()
            line = stdout.readline()
        if not line:
            return Answered(name, 0.0, f"the diagnosing process ended with code {self._child.wait()}")
        said = json.loads(line)
        return Answered(name, said["cpu_s"], said["error"])

    @property
    def pid(self) -> int:
        return self._child.pid

    @property
    def alive(self) -> bool:
        return self._child.poll() is None

    def kill(self) -> None:
        """Ends the process in mid-work, from any thread: who waits for its answer gets an error."""
        self._child.kill()

    def close(self) -> None:
        """Ends the process as soon as it has nothing to do."""
        if self._child.stdin is not None:
            with suppress(BrokenPipeError):
                self._child.stdin.close()
        if self._child.stdout is not None:
            self._child.stdout.close()
        self._child.wait()


def diagnose_cases(layout: Layout, names: Sequence[str], jobs: int, without: Sequence[str] = ()) -> Generator[Answered]:
    """In order of names; one process for each job, each taking a case at a time; `without` some physics, by name.

    Whoever leaves it before its end, by Ctrl-C too, closes it: all processes are ended in mid-work then.
    """
    begun: list[Blind] = []
    idle: SimpleQueue[Blind] = SimpleQueue()
    ended = threading.Event()

    def begin() -> Blind:
        begun.append(Blind(layout.answers, without))
        return begun[-1]

    def one(name: str) -> Answered:
        blind = idle.get()
        try:
            if not blind.alive and not ended.is_set():
                blind.close()
                blind = begin()
            if ended.is_set():
                blind.kill()
            return blind.answer(layout, name)
        finally:
            idle.put(blind)

    try:
        for _ in range(jobs):
            idle.put(begin())
        with ThreadPoolExecutor(jobs) as pool:
            try:
                yield from pool.map(one, names)
            except BaseException:
                with uninterrupted():
                    ended.set()
                    for blind in begun:
                        blind.kill()
                raise
    finally:
        with uninterrupted():
            for blind in begun:
                blind.close()


def reconciled(layout: Layout, name: str, out: Path) -> str:
    """Brings a simulation of the recording's own rig file to agree with it, by the command; results in `out`.

    What went wrong; empty where nothing did.
    """
    recording = layout.recording(name).absolute()
    layout.answers.mkdir(parents=True, exist_ok=True)
    rig = layout.answers.absolute() / f"{name}-rig.toml"
    rig.write_text(read(recording).rig_text, encoding="utf-8")
    words = ["reconcile", str(recording), "--simulation", str(rig)]
    done = subprocess.run(  # noqa: S603 - our own interpreter and our own command
        [sys.executable, "-m", "calibeam", *words, "--out", str(out.absolute())],
        capture_output=True,
        text=True,
        env=bare_environment(os.environ),
        cwd=layout.answers,
        check=False,
    )
    return "" if done.returncode == 0 else " ".join(done.stderr.split()) or f"ended with code {done.returncode}"
