"""Files that were torn off or hurt: every complete batch is read, nothing false is, and nothing hangs."""

import os
import select
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap import mcap_file
from acquisition.recording.mcap import writer as writer_module
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event, Recording

BATCHES = 12
CHUNK = 0x06  # MCAP specification, "Records"


@pytest.fixture
def whole(open_writer: Callable[..., RecordingWriter]) -> bytes:
    """A session of BATCHES flushes; in each ten samples of a stream, one settled sample and one event."""
    with open_writer(notes={"seed": "31415926"}) as writer:
        stream = writer.stream("psd", (Channel("spot_x_m", "m"),))
        rng = np.random.default_rng(5)
        for batch in range(BATCHES):
            number = np.arange(10 * batch, 10 * batch + 10)
            stream.append(1000.0 + number, number, number, {"spot_x_m": value_of(number)})
            writer.sample({"t_s": float(batch), "q1_rad": rng.normal(), "q2_rad": 0.0})
            writer.event(Event(1000.0 + batch, "tick", {"batch": batch}))
            writer.flush()
    return writer.path.read_bytes()


def value_of(number: np.ndarray) -> np.ndarray:
    return np.sin(number * 12.9898) * 1e-3


def chunk_ends(data: bytes) -> list[int]:
    """Where each complete batch ends, by the record lengths alone."""
    at, ends = 8, []
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        at += 9 + length
        if opcode == CHUNK:
            ends.append(at)
    return ends


def read_bytes(path: Path, data: bytes) -> Recording | None:
    """The recording, or None where it was refused with one of our own errors."""
    path.write_bytes(data)
    try:
        return read(path)
    except RecordingError:
        return None


def test_the_undamaged_file_is_complete(whole: bytes, tmp_path: Path) -> None:
    recording = read_bytes(tmp_path / "whole.mcap", whole)
    assert recording is not None
    assert recording.complete
    assert len(chunk_ends(whole)) == BATCHES
    assert recording.streams["psd"].sequence.tolist() == list(range(10 * BATCHES))


def test_of_a_torn_file_every_complete_batch_is_read(whole: bytes, tmp_path: Path) -> None:
    ends = np.array(chunk_ends(whole))
    begin = whole.index(b"calibeam.stream.psd")  # behind rig, versions and notes
    cuts = {*np.random.default_rng(1).integers(begin, len(whole), 125).tolist(), *ends.tolist(), *(ends - 1).tolist()}
    for cut in sorted(cuts):
        recording = read_bytes(tmp_path / "torn.mcap", whole[:cut])
        batches = int(np.count_nonzero(ends <= cut))
        assert recording is not None
        assert not recording.complete
        assert len(recording.samples) == len(recording.events) == batches
        if batches:
            assert recording.streams["psd"].sequence.tolist() == list(range(10 * batches))
            assert "the file ends too early" in recording.damage[0]


def test_a_file_torn_before_its_rig_is_refused(whole: bytes, tmp_path: Path) -> None:
    for cut in range(0, whole.index(b"calibeam.notes") - 13, 7):  # 13: length of what precedes a name
        assert read_bytes(tmp_path / "torn.mcap", whole[:cut]) is None


def test_half_a_note_is_no_note(whole: bytes, tmp_path: Path) -> None:
    for cut in range(whole.index(b"calibeam.notes"), whole.index(b"calibeam.stream.psd")):
        recording = read_bytes(tmp_path / "torn.mcap", whole[:cut])
        assert recording is not None
        assert recording.notes in ({}, {"seed": "31415926"})


def test_a_flipped_bit_is_noticed_or_harmless(whole: bytes, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    intact = read_bytes(tmp_path / "intact.mcap", whole)
    assert intact is not None
    q1_rad = intact.samples.column("q1_rad")
    end = len(whole) - 8 - len(whole) // 3
    for at, bit in zip(rng.integers(0, end, 150).tolist(), rng.integers(0, 8, 150).tolist(), strict=True):
        hurt = bytearray(whole)
        hurt[at] ^= 1 << bit
        recording = read_bytes(tmp_path / "hurt.mcap", bytes(hurt))
        if recording is None:
            continue
        assert recording.rig_text == intact.rig_text
        if "psd" in recording.streams:
            psd = recording.streams["psd"]
            np.testing.assert_array_equal(psd.values["spot_x_m"], value_of(psd.sequence))
        assert np.isin(recording.samples.column("q1_rad"), q1_rad).all()
        assert not recording.complete, f"bit {bit} of byte {at} went unnoticed"


def test_one_damaged_batch_costs_only_itself(whole: bytes, tmp_path: Path) -> None:
    hurt = bytearray(whole)
    hurt[chunk_ends(whole)[3] - 5] ^= 0xFF
    recording = read_bytes(tmp_path / "hurt.mcap", bytes(hurt))
    assert recording is not None
    assert [event.detail["batch"] for event in recording.events] == [batch for batch in range(BATCHES) if batch != 3]
    assert "a batch is damaged" in recording.damage[0]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "cannot read the recording"),
        (b"", "not a recording: the file is empty"),
        (b"t_s,q1_rad\n", "not a recording: the file begins with b't_s,q1_r'"),
        (b"\x89MCAP0\r\n", "'calibeam.recording' cannot be read"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "some.file"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        read(path)


def test_a_file_of_another_program_is_refused(whole: bytes, tmp_path: Path) -> None:
    (tmp_path / "other.mcap").write_bytes(whole.replace(b"\x08\x00\x00\x00calibeam", b"\x08\x00\x00\x00ros2bags", 1))
    with pytest.raises(RecordingError, match=r"MCAP file of another program \(profile 'ros2bags'"):
        read(tmp_path / "other.mcap")


def test_a_file_of_a_later_format_is_refused(
    open_writer: Callable[..., RecordingWriter], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_module, "FORMAT_VERSION", "2")
    later = open_writer()
    later.close()
    with pytest.raises(RecordingError, match="format version 2 is not known"):
        read(later.path)


def test_a_metadata_record_of_a_torn_file_is_proved_by_its_own_checksum(whole: bytes, tmp_path: Path) -> None:
    torn = whole[: chunk_ends(whole)[1]]
    for name, value in ((b"calibeam.notes", b"31415926"), (b"calibeam.recording", b"1000.0")):
        at = torn.index(value, torn.index(name))
        recording = read_bytes(tmp_path / "hurt.mcap", torn[:at] + b"2" + torn[at + 1 :])
        assert recording is None or (recording.notes == {} and recording.damage)


def test_batches_behind_a_damaged_length_are_found_again(whole: bytes, tmp_path: Path) -> None:
    hurt = bytearray(whole)
    ends = chunk_ends(whole)
    start = whole.index(b"\x04\x00\x00\x00zstd", ends[3]) - 37  # of the fifth batch, by the layout of a chunk
    hurt[start + 6] ^= 0x40  # its length becomes 2^46
    recording = read_bytes(tmp_path / "hurt.mcap", bytes(hurt))
    assert recording is not None
    assert not recording.complete
    assert [event.detail["batch"] for event in recording.events] == [batch for batch in range(BATCHES) if batch != 4]


def test_a_recording_of_a_version_without_checksums_is_read(
    open_writer: Callable[..., RecordingWriter], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_file, "CHECKSUM", "another key")
    with open_writer(notes={"seed": "3"}) as older:
        pass
    assert read(older.path).notes["seed"] == "3"
    assert read(older.path).complete


RECORD_UNTIL_KILLED = """
import os, sys, time
import numpy as np
from acquisition.recording.recording import Channel
from acquisition.recording.mcap.writer import RecordingWriter

class HostClock:
    def now_s(self):
        return time.monotonic()

writer = RecordingWriter(sys.argv[1], rig_text=open(sys.argv[2]).read(), software="calibeam", clock=HostClock())
stream = writer.stream("psd", (Channel("number", ""),))
number = 0
while True:
    block = np.arange(number, number + 10)
    now_s = time.monotonic()
    stream.append(np.full(10, now_s), np.full(10, now_s), block, {"number": block})
    number += 10
    if number == 5000:
        writer.flush()
        os.write(1, b"flushed 5000 0\\n")
    os.write(1, f"appended {number} {now_s!r}\\n".encode())
"""


def test_a_killed_process_loses_at_most_what_waited_for_the_disk(tmp_path: Path, rig_source: str) -> None:
    path = tmp_path / "killed.mcap"
    (tmp_path / "rig.toml").write_text(rig_source)
    command = [sys.executable, "-c", RECORD_UNTIL_KILLED, str(path), str(tmp_path / "rig.toml")]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
        said = listen(child, after_flush_s=0.6)
        child.send_signal(signal.SIGKILL)
        assert child.stdout is not None
        said += child.stdout.read()
    last = [
        line.split() for line in said.decode().splitlines() if line.startswith("appended") and line.count(" ") == 2
    ][-1]
    recording = read(path)
    psd = recording.streams["psd"]
    assert not recording.complete
    np.testing.assert_array_equal(psd.values["number"], np.arange(psd.sequence.size))
    assert psd.sequence.size >= 5000
    assert float(last[2]) - psd.host_s[-1] < 0.1 + 0.4  # the flush period, and one batch on its way on a busy machine


def listen(child: "subprocess.Popen[bytes]", after_flush_s: float) -> bytes:
    """What a child says until that long after it told of its flush; fails after 30 s."""
    assert child.stdout is not None
    descriptor, said, end_s = child.stdout.fileno(), b"", time.monotonic() + 30.0
    heard_flush = False
    while time.monotonic() < end_s:
        assert select.select([descriptor], [], [], 10.0)[0], "the recording child says nothing"
        piece = os.read(descriptor, 65536)
        assert piece, "the recording child has ended"
        said += piece
        if not heard_flush and b"flushed" in said:
            heard_flush, end_s = True, time.monotonic() + after_flush_s
    assert heard_flush
    return said
