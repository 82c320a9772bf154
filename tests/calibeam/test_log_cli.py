"""Encoder logging over a real wire: what is kept, how it ends, how it goes on."""

import dataclasses
import errno
import math
import os
import re
import signal
import struct
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec import structs

from acquisition.recording import Recording, read
from acquisition.recording.can_frames import FrameFlag, frames_of
from acquisition.recording.mcap import Rotation, mcap_file, segments
from acquisition.recording.mcap.mcap_file import DiskFile
from acquisition.recording.rig import parse_rig
from calibeam.cli import run
from calibeam.commands.log import _summary as log_summary
from calibeam.devices import encoder_log
from calibeam.devices.encoder_log import EncoderLog, LogState
from calibeam.devices.encoders import names_of
from calibeam.site_log import SITE_LOG
from drivers.cia406.codec import Scale
from drivers.cia406.configuration import EncoderIdentity
from drivers.cia406.device import Cia406Encoders
from drivers.clock import SystemClock
from drivers.device import Block, Channel
from drivers.errors import DeviceRefused, DeviceStale
from drivers.transports.can_bus import bus_opener
from simulators.encoders.emulator import build
from simulators.host.loop import Host

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
COUNTS = 1_048_576  # a turn of the emulated encoders


class Shafts:
    """Six shafts that turn."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return np.arange(6) * 0.3 + 0.5 * self.time_s


class Bus:
    """The emulated encoders, plugged in or not, always under the same path."""

    def __init__(self, path: Path) -> None:
        self.path, self.world = path, Shafts()
        self.plug()

    def plug(self) -> None:
        devices = {"encoders": {"nodes": [1, 2, 3, 4, 5, 6], "bitrate": 1_000_000, "channel": str(self.path)}}
        bench = build(self.world, {"devices": devices})
        self._host, self._stop = Host(bench, self.world), threading.Event()
        self.verbs = dict(bench.verbs)
        self._thread = threading.Thread(target=self._host.run, args=(self._stop.is_set,))
        self._thread.start()

    def unplug(self) -> None:
        if not self._stop.is_set():
            self._stop.set()
            self._thread.join()
            self._host.close()


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[Bus]:
    made = Bus(tmp_path / "can")
    yield made
    made.unplug()


@pytest.fixture
def rig_path(tmp_path: Path, bus: Bus) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(RIG.read_text().replace("out/emulated/can", str(bus.path)))
    return path


@pytest.fixture
def new_log(rig_path: Path, tmp_path: Path) -> Callable[..., EncoderLog]:
    def made(rotation: Rotation | None = None) -> EncoderLog:
        text = rig_path.read_text()
        device = parse_rig(text, "rig").devices.encoders
        return EncoderLog(device, text, tmp_path / "log", SystemClock(), rotation or Rotation(), raw=True)

    return made


def until(
    log: EncoderLog, done: Callable[[LogState], bool], tell: Callable[[LogState], None] = lambda state: None
) -> None:
    log.run(lambda: done(log.state), tell)


def only(folder: Path) -> Recording:
    (path,) = segments(folder)
    return read(path)


def test_positions_and_every_frame_are_kept(new_log, tmp_path: Path) -> None:
    log = new_log()
    until(log, lambda state: state.rows >= 30)
    recording = only(tmp_path / "log")
    assert recording.complete
    encoders = recording.streams["encoders"]
    frames = list(frames_of(recording.streams["can"]))
    assert len(frames) == log.state.frames
    syncs = [frame for frame in frames if frame.can_id == 0x080 and frame.flags & FrameFlag.SENT]
    assert len(syncs) >= encoders.sequence.size
    raw = {struct.unpack("<I", frame.data[:4])[0] % COUNTS for frame in frames if frame.can_id == 0x283}
    logged_rad = encoders.values["position_rad"][:, 2]
    logged = np.rint(logged_rad[np.isfinite(logged_rad)] / math.tau * COUNTS).astype(int) % COUNTS
    assert len(set(logged.tolist())) > 1
    assert set(logged.tolist()) <= raw  # an answer that came too late is in the raw frames only
    (lines,) = [event for event in recording.events if event.kind == "encoders"]
    assert [identity["node"] for identity in lines.detail["identities"]] == [1, 2, 3, 4, 5, 6]


def test_ctrl_c_ends_a_log_and_the_next_one_goes_on_next_to_it(new_log, tmp_path: Path) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def press(state: LogState) -> None:
        if state.rows >= 10:
            os.kill(os.getpid(), signal.SIGINT)

    try:
        until(new_log(), lambda state: False, press)
    finally:
        signal.signal(signal.SIGINT, before)
    assert only(tmp_path / "log").complete
    until(new_log(), lambda state: state.rows >= 10)
    first, second = segments(tmp_path / "log")
    assert read(second).complete
    assert read(second).notes == {"segment": "2", "segment_before": first.name}


def test_a_log_that_rotates_loses_nothing_between(new_log, tmp_path: Path) -> None:
    until(new_log(Rotation(age_s=0.25)), lambda state: state.rows >= 100)
    files = segments(tmp_path / "log")
    assert len(files) >= 3
    frames = [int(number) for file in files for number in read(file).streams["can"].sequence]
    assert frames == list(range(len(frames)))
    rows = [int(number) for file in files for number in read(file).streams["encoders"].sequence]
    assert rows == sorted(set(rows))


def test_a_bus_that_is_pulled_and_put_back_is_a_gap(new_log, bus: Bus, tmp_path: Path) -> None:
    log, rows = new_log(), [0]

    def pull_and_put_back(state: LogState) -> None:
        if state.rows >= 10 and state.outages == 0:
            bus.unplug()
        elif state.outages == 1 and state.away is not None and bus._stop.is_set():
            rows[0] = state.rows
            bus.plug()

    with SITE_LOG.heard("info"):
        until(log, lambda state: rows[0] > 0 and state.rows >= rows[0] + 10, pull_and_put_back)
    recording = only(tmp_path / "log")
    assert [event.kind for event in recording.events] == ["encoders", "device lost", "device back"]
    unknown = [gap for gap in recording.streams["encoders"].gaps if gap.missing < 0]
    assert len(unknown) == 1
    assert "encoders" in unknown[0].reason
    assert recording.complete
    said = (tmp_path / "log" / "encoders.log").read_text()
    assert re.search(r"^\S+Z WARNING \S+: device lost .*encoders", said, re.MULTILINE)
    order = ["encoders: connected", "recorded from now on", "device lost", "device back", "recording closed"]
    assert sorted(map(said.index, order)) == [said.index(words) for words in order]


def test_a_full_disk_ends_a_log_and_keeps_what_was_written(
    rig_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    room = [30_000]

    def write(descriptor: int, data: memoryview) -> int:
        if room[0] <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = os.write(descriptor, data[: room[0]])
        room[0] -= count
        return count

    monkeypatch.setattr(mcap_file, "create_file", lambda path: DiskFile(path, write))
    assert run(["log", "encoders", str(rig_path), "--out", str(tmp_path / "log")]) == 3
    said = " ".join(capsys.readouterr().err.split())
    assert "disk full (No space left on device)" in said
    recording = only(tmp_path / "log")
    assert recording.streams["encoders"].sequence.size > 10
    assert not recording.complete
    assert "WARNING calibeam.site_log: PartialResult" in (tmp_path / "log" / "encoders.log").read_text()


def test_encoders_that_are_not_there_leave_nothing_behind(new_log, bus: Bus, tmp_path: Path) -> None:
    for node in (1, 2, 3, 4, 5, 6):
        bus.verbs["encoders.silence"](node)
    with pytest.raises(DeviceStale, match="no answer from encoder node 1, 2"), SITE_LOG.heard("info"):
        until(new_log(), lambda state: False)
    assert not (tmp_path / "log").exists()


def test_a_driver_that_cannot_be_made_leaves_nothing_behind(tmp_path: Path) -> None:
    device = parse_rig(RIG.read_text(), "rig").devices.encoders
    too_fast = structs.replace(device, sync_hz=5000.0)
    with pytest.raises(DeviceRefused, match="sync_hz"):
        EncoderLog(too_fast, RIG.read_text(), tmp_path / "log", SystemClock(), Rotation(), raw=True)
    assert list(tmp_path.iterdir()) == []


def test_encoders_are_distinguished_by_their_serial_numbers() -> None:
    driver = Cia406Encoders(bus_opener("virtual", "none", 1_000_000), [1])
    one = EncoderIdentity(1, 0x20196, 5, 6, 1, 17, Scale(4096, 4096, True), 0x281, (), 0)
    driver.identities = (one,)
    before = names_of(driver)
    driver.identities = (dataclasses.replace(one, error_register=1),)  # the same one, which has had a fault meanwhile
    assert names_of(driver) == before
    driver.identities = (dataclasses.replace(one, serial_number=18),)
    assert names_of(driver) != before


class Odd:
    """Encoders of a library that once raises what nobody foresaw."""

    name = "encoders"

    def __init__(self) -> None:
        self._reads = 0

    def connect(self) -> None: ...

    def close(self) -> None: ...

    def describe(self) -> tuple[Channel, ...]:
        return (Channel("position_rad", "rad", (6,)),)

    def read(self, timeout_s: float) -> Block:
        self._reads += 1
        if self._reads == 2:
            raise KeyError("1A01h")
        number = np.array([self._reads])
        return Block(number * 1.0, number * 1.0, number, {"position_rad": np.zeros((1, 6))})


def test_what_a_library_raises_unforeseen_is_an_outage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encoder_log, "encoder_driver", lambda *_: Odd())
    device = parse_rig(RIG.read_text(), "rig").devices.encoders
    log = EncoderLog(device, RIG.read_text(), tmp_path / "log", SystemClock(), Rotation(), raw=False)
    until(log, lambda state: state.outages > 0 and state.away is None)
    (lost,) = [event for event in only(tmp_path / "log").events if event.kind == "device lost"]
    assert "KeyError: '1A01h'" in lost.detail["why"]
    gaps = only(tmp_path / "log").streams["encoders"].gaps
    assert [gap.missing for gap in gaps] == [-1, 1]  # the outage, and the row that was read while it began
    assert (log.state.gaps, log.state.missing) == (2, 1)
    assert f"rows: {log.state.rows}, at least 1 missing in 2 gaps, outages: 1" in log_summary(log.state, log.segments)


def test_the_command_logs_exports_imports_recovers(
    rig_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "log"
    assert run(["log", "encoders", str(rig_path), "--out", str(folder), "--for-s", "0.4", "--json"]) == 0
    said = msgspec.json.decode(capsys.readouterr().out)
    (segment,) = segments(folder)
    assert said["segments"] == [str(segment)]
    gaps = read(segment).streams["encoders"].gaps
    assert (said["gaps"], said["missing"]) == (len(gaps), sum(max(gap.missing, 0) for gap in gaps))
    assert said["rows"] == read(segment).streams["encoders"].sequence.size > 0
    blf, back = tmp_path / "bus.blf", tmp_path / "back.mcap"
    assert run(["export", str(segment), "--out", str(blf)]) == 0
    assert run(["import", str(blf), "--rig", str(rig_path), "--out", str(back)]) == 0
    assert f"{said['frames']} CAN frames" in capsys.readouterr().out
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(segment.read_bytes()[:-3000])
    assert run(["recover", str(segment), "--out", str(tmp_path / "whole.mcap")]) == 0
    capsys.readouterr()
    assert run(["recover", str(torn), "--out", str(tmp_path / "partial.mcap"), "--json"]) == 3
    kept = msgspec.json.decode(capsys.readouterr().out)
    assert (kept["whole"], kept["out"]) == (False, str(tmp_path / "partial.mcap"))
    assert kept["messages"] > 0
    torn.write_bytes(segment.read_bytes()[:60])
    assert run(["recover", str(torn), "--out", str(tmp_path / "nothing.mcap")]) == 1
    assert not (tmp_path / "nothing.mcap").exists()
    tables = tmp_path / "tables"
    assert run(["export", str(segment), "--out", str(tables), "--streams", "--table", "parquet"]) == 0
    assert {path.name for path in (tables / "streams").iterdir()} == {
        "can.parquet", "encoders.parquet", "events.parquet", "gaps.parquet", "streams.json",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["import", "bus.blf", "--out", "x.mcap"], "give --rig RIG.toml"),
        (["export", "missing.mcap", "--out", "x.blf"], "cannot read the recording"),
        (["recover", "missing.mcap", "--out", "x.mcap"], "cannot read the recording"),
        (["log", "encoders", str(RIG), "--rotate-mb", "0"], "above 0"),
    ],
)
def test_what_cannot_be_done_is_reported_in_one_sentence(
    arguments: list[str], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 1
    assert says in " ".join(capsys.readouterr().err.split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [["log", "encoders"], ["recover"], ["export"], ["import"]])
def test_help_has_an_example(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*command, "--help"]) == 0
    assert f"For example: calibeam {' '.join(command)}" in " ".join(capsys.readouterr().out.split())
