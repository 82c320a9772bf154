"""Workers leave Ctrl-C to the process that started them, and none outlives it."""

import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from calibeam.prove.diagnosing import Blind
from calibeam.prove.seal import Layout
from calibeam.worker_processes import in_workers

PATIENCE_S = 60.0
LONG_S = 1000.0
NAMES = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "SIGTERM"}


def test_a_worker_never_receives_ctrl_c() -> None:
    blocked = partial(signal.pthread_sigmask, signal.SIG_BLOCK)
    (signals,) = in_workers(blocked, [()], 1)
    assert signal.SIGINT in signals
    assert signal.SIGINT not in blocked(())  # here it is heard again


def test_workers_that_nobody_waits_for_are_ended_in_mid_work() -> None:
    coming = in_workers(time.sleep, [0.0, LONG_S, LONG_S, 0.0], 2)
    assert next(coming) is None
    assert multiprocessing.active_children()
    coming.close()
    assert multiprocessing.active_children() == []


def test_what_a_worker_raises_ends_the_others() -> None:
    with pytest.raises(TypeError):
        list(in_workers(time.sleep, ["no number", LONG_S], 2))  # type: ignore[list-item]
    assert multiprocessing.active_children() == []


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts the program as a terminal does: in a process group of its own, which Ctrl-C is sent to."""
    running: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> subprocess.Popen[str]:
        with (tmp_path / "errors").open("w") as errors:
            process = subprocess.Popen(
                [sys.executable, "-m", "calibeam", *arguments],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True, start_new_session=True,
            )  # fmt: skip
        running.append(process)
        return process

    yield start
    for process in running:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def by(signals: tuple[signal.Signals, ...]) -> object:
    """SIGINT every day; SIGTERM goes the same way from calibeam.cli on."""
    first, *others = signals
    return pytest.mark.parametrize(
        "number", [first, *(pytest.param(other, marks=pytest.mark.endure) for other in others)], ids=lambda s: s.name
    )


@by((signal.SIGINT, signal.SIGTERM))
def test_a_proof_that_is_interrupted_ends_in_one_sentence(started, tmp_path, number) -> None:
    out = tmp_path / "proof"
    process = started("prove", "--family", "tracker", "--cases", "3", "--out", str(out))
    until(lambda: len(descendants(process.pid)) >= 2)  # one of them counts semaphores, the other loads its libraries
    workers = descendants(process.pid)
    interrupt(process, number)
    assert process.wait(PATIENCE_S) == 3
    (said,) = (tmp_path / "errors").read_text().splitlines()
    assert said.startswith(f"stopped: {NAMES[number]}; nothing was finished; the files are kept in {out}")
    until(lambda: not any(map(alive, workers)))


def test_a_diagnosing_process_is_ended_in_mid_work_and_who_waits_gets_an_error(tmp_path) -> None:
    blind = Blind(tmp_path / "answers")
    try:
        assert os.getsid(blind.pid) != os.getsid(0)  # Ctrl-C goes to the processes of a terminal's session
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(blind.answer, Layout(tmp_path), "case")
            blind.kill()
            assert "ended with code -9" in answer.result(PATIENCE_S).error
    finally:
        blind.close()


@pytest.mark.endure  # three cases have to be concealed first
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_proof_that_is_interrupted_while_diagnosing_ends_in_one_sentence(started, tmp_path, number) -> None:
    out = tmp_path / "proof"
    process = started("prove", "--family", "tracker", "--cases", "3", "--out", str(out))
    for line in process.stdout:
        if line.startswith("SHA-256"):
            break  # from now on the diagnosing processes are started, and load their libraries
    workers = until(lambda: descendants(process.pid))
    interrupt(process, number)
    assert process.wait(PATIENCE_S) == 3
    (said,) = (tmp_path / "errors").read_text().splitlines()
    assert said.startswith(f"stopped: {NAMES[number]}; concealed 3 of 3; the files are kept in {out}")
    assert said.endswith("start it again with another --out")
    until(lambda: not any(map(alive, workers)))


@by((signal.SIGINT, signal.SIGTERM))
def test_a_fleet_that_is_interrupted_ends_in_one_sentence(started, tmp_path, number) -> None:
    for name in "abcdefgh":
        (tmp_path / f"{name}.mcap").write_text("no recording")
    process = started("batch", str(tmp_path), "--out", str(tmp_path / "out"), "--jobs", "2", "--json")
    until(lambda: len(descendants(process.pid)) >= 2)  # joblib's workers, which load their libraries
    workers = descendants(process.pid)
    interrupt(process, number)
    assert process.wait(PATIENCE_S) == 3
    said = (tmp_path / "errors").read_text()
    assert "Traceback" not in said
    assert f"stopped: {NAMES[number]}; " in said.splitlines()[-1]
    assert re.search(r"left: \d; the same command goes on$", said.splitlines()[-1])
    until(lambda: not any(map(alive, workers)))


def interrupt(process: subprocess.Popen[str], number: signal.Signals) -> None:
    if number is signal.SIGINT:
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)


def until(condition: Callable[[], object]) -> object:
    end_s = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        assert time.monotonic() < end_s
        time.sleep(0.01)
    return value


def alive(pid: int) -> bool:
    """Whether it runs; a dead one that nobody has collected yet does not."""
    try:
        return _stat(pid)[0] != "Z"
    except OSError:
        return False


def descendants(pid: int) -> list[int]:
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        try:
            parents[int(entry.name)] = int(_stat(int(entry.name))[1])
        except (OSError, ValueError):
            continue
    found = [child for child, parent in parents.items() if parent == pid]
    return found + [grandchild for child in found for grandchild in descendants(child)]


def _stat(pid: int) -> list[str]:
    """State, parent and so on: behind the name, which may hold anything."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
