"""Ctrl-C and SIGTERM in a command that makes files of other files: one sentence, exit code 1, and no half of a file."""

import importlib
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import can
import msgspec
import numpy as np
import pytest

from acquisition.recording.files import write_json
from calibeam.cli import run
from calibeam.outcome import Interrupts, taken_back
from tests.calibeam.test_compare_simulations import EXAMPLES, arm, session

ROWS = 48
STATED = "q1_rad..q6_rad [rad] = q, x_m y_m z_m [m] = position, t_s [s] = time"
WRITER = "acquisition.recording.mcap.writer:RecordingWriter"
FOLDER = "acquisition.recording.session_folder.folder"
RECONCILE = "reconcile measured --simulation rig.toml --out made"
CUBE = "--cycles 2 --centre-m 0.4 0 0.35 --edge-m 0.1"
# Command line, where the signal comes, and which call of it: while it computes, and in the middle of what it writes.
# One computes for seconds before it writes its page: daily, it is broken off before, and others while they write.
CASES = (
    ("import measured --out made.mcap", f"{WRITER}.sample", 5),
    ("import table.csv --rig rig.toml --columns COLUMNS --yes --out made", f"{FOLDER}:write_csv", 1),
    ("import table.csv --rig rig.toml --columns COLUMNS --yes --out made", "pathlib:Path.replace", 1),
    ("import table.csv --streams --rig rig.toml --columns COLUMNS --yes --out made.mcap", f"{WRITER}.stream", 1),
    ("import table.csv --streams --rig rig.toml --columns COLUMNS --yes --out made.mcap", "pathlib:Path.replace", 1),
    ("import bus.log --rig rig.toml --out made.mcap", f"{WRITER}.stream", 1),
    ("export measured --out made", f"{FOLDER}:write_csv", 1),
    ("replay measured --model model.json --out made.mcap", "calibeam.commands.replay:replay", 1),
    ("replay measured --model model.json --out made.mcap", f"{WRITER}.sample", 5),
    (RECONCILE, "calibeam.commands.reconcile:reconcile", 1),
    (RECONCILE, "calibeam.results.reconciliation:replay", 1),
    pytest.param(RECONCILE, "calibeam.commands.reconcile:write_reconciliation_page", 1, marks=pytest.mark.endure),
    (f"iso9283 plan rig.toml {CUBE} --out made.toml", "calibeam.commands.iso9283:_write_poses", 1),
    ("iso9283 evaluate cycled --out made.json", "calibeam.commands.iso9283:evaluate", 1),
    ("iso9283 evaluate cycled --out made.json", "pathlib:Path.replace", 1),
)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A tracker's session, its model and its table, a session of cycles, and a CAN log."""
    folder = tmp_path_factory.mktemp("good")
    q_rad = np.random.default_rng(5).uniform(-1.5, 1.5, (ROWS, 6)) + np.array([0.0, -1.0, 0.5, 0.0, 0.8, 0.0])
    session(folder / "measured", q_rad, q_rad + np.array([0.0, 0.0, 1e-3, 0.0, 0.0, 0.0]), arm())
    again = np.tile(q_rad[:4], (3, 1))
    session(folder / "cycled", again, again, arm())
    shutil.copy(folder / "measured" / "samples.csv", folder / "table.csv")
    shutil.copy(EXAMPLES / "rig.toml", folder / "rig.toml")
    with can.CanutilsLogWriter(folder / "bus.log") as log:
        for k in range(9):
            log.on_message_received(can.Message(timestamp=1e9 + k, arbitration_id=k, data=bytes(4), channel=0))
    assert run(["identify", str(folder / "measured"), "--out", str(folder / "model.json")]) == 0
    return folder


@pytest.fixture
def handler():
    """The program's own, for this test."""
    before = {number: signal.signal(number, Interrupts().came) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, one in before.items():
        signal.signal(number, one)


def comes(monkeypatch, place, call, number):
    """The signal, instead of this call of the function at `place`."""
    module, _, name = place.partition(":")
    owner = importlib.import_module(module)
    *classes, name = name.split(".")
    for one in classes:
        owner = getattr(owner, one)
    real, calls = getattr(owner, name), []

    def stands_for(*words, **named):
        calls.append(None)
        if len(calls) == call:
            signal.raise_signal(number)
        return real(*words, **named)

    monkeypatch.setattr(owner, name, stands_for)
    return calls


def left(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.mark.usefixtures("bare_figures")
@pytest.mark.parametrize(("words", "place", "call"), CASES)
def test_no_half_of_a_file_stays(words, place, call, inputs, handler, tmp_path, monkeypatch, capfd) -> None:
    folder = tmp_path / "here"
    shutil.copytree(inputs, folder)
    monkeypatch.chdir(folder)
    before = left(folder)
    calls = comes(monkeypatch, place, call, signal.SIGINT)
    assert run([STATED if word == "COLUMNS" else word for word in words.split()]) == 1
    assert len(calls) == call
    assert capfd.readouterr().err == "stopped by Ctrl-C\n"
    assert left(folder) == before


def test_sigterm_ends_alike_and_leaves_an_empty_folder_as_it_was(inputs, handler, tmp_path, monkeypatch, capfd):
    made = tmp_path / "made"
    made.mkdir()
    comes(monkeypatch, f"{FOLDER}:write_csv", 1, signal.SIGTERM)
    assert run(["export", str(inputs / "measured"), "--out", str(made)]) == 1
    assert capfd.readouterr().err == "stopped by SIGTERM\n"
    assert left(made) == []


def test_what_stood_there_before_stays(tmp_path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    (old / "kept").touch()

    def half(why: BaseException) -> None:
        with taken_back(old, old / "kept", new):
            (old / "begun").mkdir()
            (old / "begun" / "file").touch()
            new.touch()
            raise why

    with pytest.raises(KeyboardInterrupt):
        half(KeyboardInterrupt())
    assert left(tmp_path) == ["old", "old/kept"]
    with pytest.raises(OSError, match="full"):  # its own message says what stays
        half(OSError("full"))
    assert new.exists()


class Some(msgspec.Struct):
    number: int
    schema: int = 1
    kind: str = "calibeam-some"


def test_a_json_file_is_as_it_was_until_the_new_one_is_whole(tmp_path, monkeypatch) -> None:
    path = tmp_path / "some.json"
    write_json(path, Some(1))

    def interrupted(*_) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_json(path, Some(2))
    assert (left(tmp_path), msgspec.json.decode(path.read_bytes(), type=Some)) == (["some.json"], Some(1))


# The console command with Ctrl-C at the fifth sample that is written.
INTERRUPTED = """
import os, signal, sys
from acquisition.recording import RecordingWriter
from calibeam.cli import main
real, calls = RecordingWriter.sample, []
def sample(self, *words):
    calls.append(real(self, *words))
    if len(calls) == 5:
        os.kill(os.getpid(), signal.SIGINT)
RecordingWriter.sample = sample
main()
"""


def test_the_program_ends_without_a_traceback_of_any_thread(inputs, tmp_path) -> None:
    words = ["import", str(inputs / "measured"), "--out", str(tmp_path / "made.mcap")]
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, *words], capture_output=True, text=True, timeout=60.0)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "stopped by Ctrl-C\n")
    assert left(tmp_path) == []
