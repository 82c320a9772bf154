"""Recovery: a new, whole file of what is good, which says what is lost."""

import errno
import io
import os
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.layout import (
    EVENT,
    FORMAT_VERSION,
    RECORDING_METADATA,
    RIG_METADATA,
    MessageType,
    packed,
)
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.recover import recover
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event
from acquisition.recording.rig import rig_sha256

BATCHES = 12
Open = Callable[..., RecordingWriter]


@pytest.fixture
def source(open_writer: Open) -> Path:
    """Ten samples of a stream, one settled sample and one event in each batch."""
    with open_writer(notes={"seed": "31415926"}) as writer:
        stream = writer.stream("psd", (Channel("spot_x_m", "m"), Channel("flags", "")))
        for batch in range(BATCHES):
            number = np.arange(10 * batch, 10 * batch + 10)
            stream.append(1000.0 + number, number, number, {"spot_x_m": number * 1e-6, "flags": number})
            writer.sample({"t_s": float(batch), "q1_rad": 0.1 * batch, "q2_rad": 0.0})
            writer.event(Event(1000.0 + batch, "tick", {"batch": batch}))
            writer.flush()
    return writer.path


def batch_starts(data: bytes) -> list[int]:
    at, starts = 8, []
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        if opcode == 0x06:
            starts.append(at)
        at += 9 + length
    return starts


def test_of_a_torn_file_everything_before_the_tear_is_in_a_whole_one(source: Path, tmp_path: Path) -> None:
    data = source.read_bytes()
    source.write_bytes(data[: batch_starts(data)[7] + 20])
    done = recover(source, tmp_path / "recovered.mcap")
    torn, recovered = read(source), read(tmp_path / "recovered.mcap")
    assert not done.whole
    assert recovered.streams["psd"].sequence.tolist() == torn.streams["psd"].sequence.tolist() == list(range(70))
    np.testing.assert_array_equal(recovered.streams["psd"].values["spot_x_m"], np.arange(70) * 1e-6)
    assert recovered.samples.column("q1_rad").tolist() == torn.samples.column("q1_rad").tolist()
    assert recovered.events == torn.events
    assert recovered.notes == torn.notes
    assert (recovered.rig_text, recovered.host_s0, recovered.started_utc) == (
        torn.rig_text,
        torn.host_s0,
        torn.started_utc,
    )
    assert not recovered.complete
    assert "the file ends too early" in recovered.damage[0]


def test_other_readers_find_an_index_in_the_recovered_file(source: Path, tmp_path: Path) -> None:
    source.write_bytes(source.read_bytes()[:-200])
    recover(source, tmp_path / "recovered.mcap")
    with (tmp_path / "recovered.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert len(list(reader.iter_messages(topics=["events"]))) == BATCHES


def test_a_whole_file_is_recovered_whole(source: Path, tmp_path: Path) -> None:
    done = recover(source, tmp_path / "recovered.mcap")
    assert done.whole
    assert done.damage == ()
    recovered = read(tmp_path / "recovered.mcap")
    assert recovered.complete
    assert recovered.streams["psd"].sequence.size == 10 * BATCHES


def test_a_session_that_was_cut_short_stays_so(open_writer: Open, tmp_path: Path) -> None:
    writer = open_writer()
    writer.close(complete=False)
    done = recover(writer.path, tmp_path / "recovered.mcap")
    assert done.whole
    assert not read(tmp_path / "recovered.mcap").complete


def test_what_lies_behind_the_damage_is_recovered_too(source: Path, tmp_path: Path) -> None:
    data = bytearray(source.read_bytes())
    data[batch_starts(bytes(data))[5] + 5] ^= 1  # the length of one batch
    source.write_bytes(bytes(data))
    done = recover(source, tmp_path / "recovered.mcap")
    assert not done.whole
    recovered = read(tmp_path / "recovered.mcap")
    assert [event.detail["batch"] for event in recovered.events] == [b for b in range(BATCHES) if b != 5]


def test_a_damaged_rig_can_be_given_again(source: Path, tmp_path: Path, rig_source: str) -> None:
    data = source.read_bytes()
    source.write_bytes(data.replace(b'name = "two-joint"', b'name = "two-jXint"', 1))
    with pytest.raises(RecordingError, match=r"nothing can be recovered: 'calibeam.rig' .* give it with --rig"):
        recover(source, tmp_path / "recovered.mcap")
    assert not (tmp_path / "recovered.mcap").exists()
    assert not recover(source, tmp_path / "recovered.mcap", rig_source).whole
    assert len(read(tmp_path / "recovered.mcap").samples) == BATCHES


def test_a_lost_start_is_reported_and_not_made_up(source: Path, tmp_path: Path) -> None:
    source.write_bytes(source.read_bytes().replace(b"1000.0", b"1600.0", 1))
    assert not recover(source, tmp_path / "recovered.mcap").whole
    recovered = read(tmp_path / "recovered.mcap")
    assert np.isnan(recovered.host_s0)
    assert any("count from an unknown start" in says for says in recovered.damage)


class BadDisk(io.FileIO):
    """A file of which one stretch of bytes cannot be read."""

    def __init__(self, path: Path, bad: range) -> None:
        super().__init__(path, "rb")
        self._bad = bad

    def readinto(self, buffer) -> int:
        begin, room = self.tell(), memoryview(buffer).cast("B")
        if begin in self._bad:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return super().readinto(room[: self._bad.start - begin] if begin < self._bad.start else room)


def test_what_a_disk_still_reads_is_recovered_on_both_sides_of_a_bad_sector(
    open_writer: Open, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(3)
    with open_writer() as writer:
        stream = writer.stream("psd", (Channel("spot_x_m", "m"),))
        for batch in range(BATCHES):
            number = np.arange(100 * batch, 100 * batch + 100)
            stream.append(1000.0 + number, number, number, {"spot_x_m": rng.normal(size=100)})
            writer.flush()
    data, plain = writer.path.read_bytes(), Path.open
    starts = batch_starts(data)
    ends = [start + 9 + struct.unpack_from("<Q", data, start + 1)[0] for start in starts]
    bad = range(starts[5] // 4096 * 4096 + 4096, starts[5] // 4096 * 4096 + 8192)
    assert starts[4] + 4096 < bad.stop < starts[-1]

    def opened(path: Path, *how: str) -> io.BufferedIOBase:
        return io.BufferedReader(BadDisk(path, bad)) if path == writer.path else plain(path, *how)

    monkeypatch.setattr(Path, "open", opened)
    done = recover(writer.path, tmp_path / "recovered.mcap")
    assert not done.whole
    assert "the disk cannot read it (Input/output error)" in done.damage[0]
    lost = [b for b in range(BATCHES) if starts[b] < bad.stop and ends[b] > bad.start]
    got = read(tmp_path / "recovered.mcap").streams["psd"].sequence
    assert (set(range(BATCHES)) - set((got // 100).tolist())) == set(lost)


def test_a_description_that_makes_no_sense_costs_its_messages_only(tmp_path: Path, rig_source: str) -> None:
    file = McapFile(tmp_path / "odd.mcap", "calibeam")
    file.metadata(RECORDING_METADATA, {"format_version": FORMAT_VERSION, "software": "calibeam", "host_s0": "0.0"})
    file.metadata(RIG_METADATA, {"text": rig_source, "sha256": rig_sha256(rig_source)})
    file.write(file.topic("odd", MessageType("calibeam.odd", b"\xff\xff", EVENT.new), {}), 1, b"?")
    file.write(file.topic("events", EVENT, {}), 2, packed(EVENT, {"host_s": 1.0, "kind": "tick", "detail_json": "{}"}))
    file.finish()
    done = recover(tmp_path / "odd.mcap", tmp_path / "recovered.mcap")
    assert any("1 descriptions of messages make no sense" in says for says in done.damage)
    assert any("1 messages of which the description is lost" in says for says in done.damage)
    assert [event.kind for event in read(tmp_path / "recovered.mcap").events] == ["tick"]


def test_nothing_is_overwritten_and_nothing_is_made_of_nothing(source: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="never overwritten"):
        recover(source, source)
    (tmp_path / "junk.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    with pytest.raises(RecordingError, match="nothing can be recovered"):
        recover(tmp_path / "junk.mcap", tmp_path / "recovered.mcap")
    assert not (tmp_path / "recovered.mcap").exists()
