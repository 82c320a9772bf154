"""A disk that is full or stalls: the session is told clearly, and what was recorded stays readable."""

import errno
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap import mcap_file
from acquisition.recording.mcap.mcap_file import DiskFile
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.write_thread import Spool
from acquisition.recording.mcap.writer import RecordingWriter, StreamWriter
from acquisition.recording.recording import Channel

Open = Callable[..., RecordingWriter]
SPOT = Channel("spot_x_m", "m")
SAMPLE = {"t_s": 0.0, "q1_rad": 0.0, "q2_rad": 0.0}


class SmallDisk:
    """Takes `room` bytes, the last of them in the middle of a write, then fails."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, failure: int = errno.ENOSPC) -> None:
        self.room, self._failure = 1 << 30, failure
        monkeypatch.setattr(mcap_file, "create_file", lambda path: DiskFile(path, self.write))

    def write(self, descriptor: int, data: memoryview) -> int:
        if self.room == 0:
            raise OSError(self._failure, os.strerror(self._failure))
        count = os.write(descriptor, data[: self.room])
        self.room -= count
        return count


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> SmallDisk:
    return SmallDisk(monkeypatch)


def append(stream: StreamWriter, first: int, count: int) -> None:
    number = np.arange(first, first + count)
    values = np.random.default_rng(first).normal(size=count)
    stream.append(1000.0 + number * 1e-3, number, number, {"spot_x_m": values})


def test_a_full_disk_is_reported_and_costs_only_what_did_not_fit(open_writer: Open, disk: SmallDisk) -> None:
    writer = open_writer()
    stream = writer.stream("psd", (SPOT,))
    append(stream, 0, 1501)
    writer.flush()
    disk.room = 500
    append(stream, 1501, 1000)
    with pytest.raises(RecordingError) as lines:
        writer.flush()
    assert str(lines.value) == (
        f"disk full (No space left on device): 1.5 s recorded are safe in {writer.path}; free space and resume"
    )
    for another_try in (lambda: append(stream, 2501, 1), lambda: writer.sample(SAMPLE), writer.flush, writer.close):
        with pytest.raises(RecordingError, match=r"disk full .* 1\.5 s recorded are safe"):
            another_try()
    recording = read(writer.path)
    assert recording.streams["psd"].sequence.tolist() == list(range(1501))
    assert not recording.complete
    assert recording.damage[0].startswith(f"byte {writer.path.stat().st_size} of {writer.path.stat().st_size}")


def test_a_disk_that_is_full_at_the_very_end_spoils_nothing(open_writer: Open, disk: SmallDisk) -> None:
    writer = open_writer()
    writer.sample(SAMPLE)
    writer.flush()
    disk.room = 40  # less than the index
    with pytest.raises(RecordingError, match="disk full"):
        writer.close()
    assert len(read(writer.path).samples) == 1
    assert not read(writer.path).complete


def test_a_disk_that_is_full_from_the_start_leaves_no_file(open_writer: Open, disk: SmallDisk, tmp_path: Path) -> None:
    disk.room = 100
    with pytest.raises(RecordingError, match="cannot begin the recording"):
        open_writer()
    assert list(tmp_path.iterdir()) == []


def test_what_ended_the_session_is_not_hidden_by_a_full_disk(open_writer: Open, disk: SmallDisk) -> None:
    def session(writer: RecordingWriter) -> None:
        with writer:
            disk.room = 0
            writer.sample(SAMPLE)
            raise RuntimeError("protective stop")

    with pytest.raises(RuntimeError, match="protective stop"):
        session(open_writer())


def test_another_failure_of_the_disk_is_named(open_writer: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = SmallDisk(monkeypatch, errno.EIO)
    writer = open_writer()
    disk.room = 0
    writer.sample(SAMPLE)
    with pytest.raises(RecordingError, match=r"cannot write the recording \(Input/output error\): .* check the disk"):
        writer.close()


def test_who_measures_does_not_wait_for_a_stalled_disk(open_writer: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    disk, stalled, go_on = SmallDisk(monkeypatch), threading.Event(), threading.Event()
    writer = open_writer()
    write = disk.write

    def stall(descriptor: int, data: memoryview) -> int:
        stalled.set()
        assert go_on.wait(30.0)
        return write(descriptor, data)

    monkeypatch.setattr(writer._scribe._file._disk, "_write", stall)
    stream = writer.stream("psd", (SPOT,))
    append(stream, 0, 10)
    assert stalled.wait(30.0)
    for first in range(10, 5000, 10):
        append(stream, first, 10)
    go_on.set()
    writer.close()
    assert read(writer.path).streams["psd"].sequence.tolist() == list(range(5000))


def test_a_disk_that_falls_behind_is_reported_before_memory_runs_out() -> None:
    spool: Spool[str] = Spool("session.mcap", limit_bytes=3 << 20)
    spool.put("a", 2 << 20)
    with pytest.raises(RecordingError, match=r"session.mcap: the disk is too slow, 2 MiB wait"):
        spool.put("b", 2 << 20)
    assert spool.take(0.0) == ["a"]
    spool.put("c", 2 << 20)


def test_waiting_for_a_disk_that_never_answers_ends() -> None:
    spool: Spool[str] = Spool("session.mcap")
    spool.put("a", 1)
    with pytest.raises(RecordingError, match="the disk has not answered for 0 s"):
        spool.settle(0.01)


RECORD_UNTIL_FULL = """
import resource, sys
import numpy as np
from acquisition.recording.errors import RecordingError
from acquisition.recording.recording import Channel
from acquisition.recording.mcap.writer import RecordingWriter

class Standing:
    def now_s(self):
        return 0.0

resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
writer = RecordingWriter(sys.argv[1], rig_text=open(sys.argv[2]).read(), software="calibeam", clock=Standing())
stream = writer.stream("psd", (Channel("noise", ""),))
try:
    for block in range(1000):
        number = np.arange(100 * block, 100 * block + 100)
        stream.append(number * 1e-3, number, number, {"noise": np.random.default_rng(block).normal(size=100)})
        writer.flush()
except RecordingError as error:
    print(error)
"""


def test_the_limit_of_a_real_file_system_is_met_in_the_same_way(tmp_path: Path, rig_source: str) -> None:
    path = tmp_path / "full.mcap"
    (tmp_path / "rig.toml").write_text(rig_source)
    command = [sys.executable, "-c", RECORD_UNTIL_FULL, str(path), str(tmp_path / "rig.toml")]
    said = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=True)
    count = read(path).streams["psd"].sequence.size
    assert count > 5000
    assert count % 100 == 0
    assert said.stdout == (
        f"disk full (File too large): {(count - 1) * 1e-3:.1f} s recorded are safe in {path}; free space and resume\n"
    )
    assert said.stderr == ""
