"""CAN logs in and out through python-can: every frame comes back as it was, whatever its kind."""

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest

from acquisition.recording.can_frames import Frame, FrameFlag, block_of, channels, frames_of, stream_names
from acquisition.recording.can_log import SUFFIXES, export_can, frame_of, import_can, plain_block
from acquisition.recording.check_recording import Problem, check
from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Recording

Open = Callable[..., RecordingWriter]
START_S = 1_790_000_000.25  # in 2026


def messages() -> list[can.Message]:
    """A thousand frames of all the kinds that every format can hold."""
    rng = np.random.default_rng(4)
    made = []
    for number in range(1000):
        extended = bool(number % 3 == 0)
        remote = number % 50 == 7
        data = b"" if remote else rng.bytes(int(rng.integers(0, 9)))
        made.append(
            can.Message(
                timestamp=START_S + number * 1e-3,
                arbitration_id=int(rng.integers(0, 0x1FFFFFFF if extended else 0x7FF)),
                is_extended_id=extended,
                is_remote_frame=remote,
                dlc=4 if remote else len(data),
                data=data,
                channel=0,
            )
        )
    return made


@pytest.fixture
def record_frames(open_writer: Open) -> Callable[..., Recording]:
    def made(heard: list[can.Message], width: int = 8, sent: bool = False) -> Recording:
        frames = [frame_of(message, message.timestamp - START_S + 1000.0, sent=sent) for message in heard]
        with open_writer(host_s0=1000.0) as writer:
            block = block_of(frames, width)
            stream = writer.stream("can", channels(width), viewer=())
            stream.append(block.host_s, block.device_s, np.arange(len(frames)), block.values)
        return read(writer.path)

    return made


def test_plain_frames_make_the_same_block_as_one_by_one() -> None:
    plain = [message for message in messages() if not (message.is_extended_id or message.is_remote_frame)]
    plain[3].timestamp = 0.0
    heard = [(plain[:4], 50.0, False), ([], 50.5, True), (plain[4:5], 51.0, True), (plain[5:], 52.0, False)]
    slowly = block_of([frame_of(m, host_s, sent=sent) for several, host_s, sent in heard for m in several])
    block = plain_block(heard)
    assert block is not None
    assert block.values.keys() == slowly.values.keys()
    for name in slowly.values:
        np.testing.assert_array_equal(block.values[name], slowly.values[name], strict=True)
    np.testing.assert_array_equal(block.host_s, slowly.host_s, strict=True)
    np.testing.assert_array_equal(block.device_s, slowly.device_s, strict=True)


@pytest.mark.parametrize(
    "kind", [{"is_extended_id": True}, {"is_remote_frame": True}, {"is_error_frame": True}, {"is_fd": True}]
)
def test_a_block_with_another_frame_is_not_plain(kind: dict[str, bool]) -> None:
    other = can.Message(**{"is_extended_id": False, "data": b"1"} | kind)
    assert plain_block([(messages()[1:3], 50.0, False), ([other], 51.0, False)]) is None
    assert plain_block([([can.Message(is_extended_id=False, data=bytes(9))], 50.0, False)]) is None


def kinds(recording: Recording) -> list[tuple[int, int, int, bytes]]:
    (stream,) = recording.streams.values()
    return [(frame.can_id, frame.flags, frame.length, frame.data) for frame in frames_of(stream)]


def written_in(suffix: str, kind: tuple[int, int, int, bytes]) -> tuple[int, int, int, bytes]:
    """The frame as the format can hold it: python-can's candump writes no length for a remote frame."""
    can_id, flags, length, data = kind
    return can_id, flags, 0 if suffix == ".log" and flags & FrameFlag.REMOTE else length, data


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frames_go_out_and_come_back_the_same(suffix: str, record_frames, tmp_path: Path, rig_source: str) -> None:
    recording = record_frames(messages())
    log = tmp_path / f"bus{suffix}"
    assert export_can(recording, log) == 1000
    done = import_can(log, tmp_path / "back.mcap", rig_text=rig_source, software="calibeam")
    assert (done.frames, done.damage) == (1000, None)
    back = read(tmp_path / "back.mcap")
    assert back.complete
    assert kinds(back) == [written_in(suffix, kind) for kind in kinds(recording)]
    (stream,) = back.streams.values()
    np.testing.assert_allclose(np.diff(stream.host_s), 1e-3, rtol=0.0, atol=2e-6)
    assert check(back) == ()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_logs_that_python_can_wrote_are_read_with_their_absolute_times(
    suffix: str, tmp_path: Path, rig_source: str
) -> None:
    written = messages()
    with can.Logger(tmp_path / f"bus{suffix}") as logger:
        for message in written:
            logger(message)
    import_can(tmp_path / f"bus{suffix}", tmp_path / "back.mcap", rig_text=rig_source, software="calibeam")
    back = read(tmp_path / "back.mcap")
    (stream,) = back.streams.values()
    assert [frame.data for frame in frames_of(stream)] == [bytes(message.data) for message in written]
    np.testing.assert_allclose(stream.device_s, [m.timestamp for m in written], rtol=0.0, atol=1.5e-3)  # ASC: ms


def test_what_python_can_reads_of_our_blf_is_what_was_heard(record_frames, tmp_path: Path) -> None:
    heard = messages()
    export_can(record_frames(heard), tmp_path / "bus.blf")
    with can.BLFReader(tmp_path / "bus.blf") as reader:
        found = list(reader)
    assert [bytes(m.data) for m in found] == [bytes(m.data) for m in heard]
    assert [m.arbitration_id for m in found] == [m.arbitration_id for m in heard]
    assert all(m.is_rx for m in found)


def test_sent_frames_are_distinguished_from_heard_ones(record_frames, tmp_path: Path) -> None:
    export_can(record_frames(messages()[:5], sent=True), tmp_path / "bus.blf")
    with can.BLFReader(tmp_path / "bus.blf") as reader:
        assert not any(message.is_rx for message in reader)


def test_frames_of_can_fd_keep_all_their_bytes(record_frames, tmp_path: Path, rig_source: str) -> None:
    data = bytes(range(64))
    long = can.Message(timestamp=START_S, arbitration_id=5, is_fd=True, bitrate_switch=True, data=data, dlc=64)
    export_can(record_frames([long], width=64), tmp_path / "bus.blf")
    import_can(tmp_path / "bus.blf", tmp_path / "back.mcap", rig_text=rig_source, software="calibeam")
    (stream,) = read(tmp_path / "back.mcap").streams.values()
    (frame,) = frames_of(stream)
    assert frame.data == data
    assert frame.flags & FrameFlag.FD


def test_a_long_frame_does_not_fit_into_a_classic_stream() -> None:
    with pytest.raises(ValueError, match="12 bytes in a stream of 8"):
        block_of([Frame(0.0, 0.0, 1, 0, 12, bytes(12))])


def test_each_bus_of_a_file_gets_a_stream_of_its_own(tmp_path: Path, rig_source: str) -> None:
    with can.Logger(tmp_path / "two.log") as logger:
        for number in range(20):
            name = "can0" if number % 2 else "can1"
            logger(can.Message(timestamp=START_S + number, arbitration_id=number, channel=name, is_extended_id=False))
    import_can(tmp_path / "two.log", tmp_path / "two.mcap", rig_text=rig_source, software="calibeam")
    recording = read(tmp_path / "two.mcap")
    assert {name: stream.host_s.size for name, stream in recording.streams.items()} == {"can-can0": 10, "can-can1": 10}
    export_can(recording, tmp_path / "again.log")
    with can.CanutilsLogReader(tmp_path / "again.log") as reader:
        again = list(reader)
    assert [m.arbitration_id for m in again] == list(range(20))
    assert [m.channel for m in again[:2]] == ["can1", "can0"]


@pytest.mark.parametrize("stamp", ["nan", "inf", "1e300", "-1.0"])
def test_a_stamp_that_is_no_time_is_where_the_file_makes_no_sense(stamp: str, tmp_path: Path, rig_source: str) -> None:
    rows = "\n".join(f"{time_s},0x1,0,0,0,1,AA==" for time_s in ("1790000000.1", "1790000000.2", stamp, "1790000000.4"))
    (tmp_path / "bus.csv").write_text("timestamp,arbitration_id,extended,remote,error,dlc,data\n" + rows)
    done = import_can(tmp_path / "bus.csv", tmp_path / "back.mcap", rig_text=rig_source, software="calibeam")
    assert (done.frames, read(tmp_path / "back.mcap").complete) == (2, False)
    assert done.damage is not None
    assert "time stamp" in done.damage


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_without_a_date_times_count_from_the_first_frame(suffix: str, record_frames, tmp_path: Path) -> None:
    recording = dataclasses.replace(record_frames(messages()[:5]), host_s0=math.nan)
    export_can(recording, tmp_path / f"bus{suffix}")
    with can.LogReader(tmp_path / f"bus{suffix}") as reader:
        times_s = [message.timestamp for message in reader]
    np.testing.assert_allclose(times_s, np.arange(5) * 1e-3, atol=2e-6)


def test_channels_whose_names_fold_into_one_keep_their_own_streams() -> None:
    buses = ["a/b", "a.b", "A-B", "a-b-2", 0, "0", None]
    named = stream_names(buses)
    assert list(named.values()) == buses
    assert len({name.lower() for name in named}) == len(buses)
    assert [name for name, bus in named.items() if bus in ("a/b", "a.b", None)] == ["can-a-b", "can-a-b-2", "can"]


def test_of_a_torn_log_what_came_before_is_kept_and_reported(record_frames, tmp_path: Path, rig_source: str) -> None:
    export_can(record_frames(messages()), tmp_path / "bus.csv")
    text = (tmp_path / "bus.csv").read_text()
    lines = text.splitlines()
    (tmp_path / "bus.csv").write_text("\n".join([*lines[:401], "1790000000.65,0x1F"]))
    done = import_can(tmp_path / "bus.csv", tmp_path / "torn.mcap", rig_text=rig_source, software="calibeam")
    assert done.frames == 400
    assert done.damage is not None
    assert not read(tmp_path / "torn.mcap").complete


def test_error_frames_are_kept_and_found(record_frames) -> None:
    error = can.Message(timestamp=START_S, is_error_frame=True, arbitration_id=0x20000080 & 0x7FF, data=bytes(8), dlc=8)
    recording = record_frames([*messages()[:3], error])
    assert kinds(recording)[3][1] & FrameFlag.ERROR
    assert Problem.ERROR_FRAMES in {finding.problem for finding in check(recording)}


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("bus.xyz", "", "no CAN log format"),
        ("bus.log", "", "no CAN frame in it"),
        ("bus.blf", "not a BLF file, but longer than a header of one" * 5, "no CAN frame in it"),
        ("missing.asc", None, "cannot read it"),
    ],
)
def test_what_is_no_can_log_is_refused(
    name: str, content: str | None, says: str, tmp_path: Path, rig_source: str
) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(RecordingError, match=says):
        import_can(tmp_path / name, tmp_path / "back.mcap", rig_text=rig_source, software="calibeam")
    assert not (tmp_path / "back.mcap").exists()


def test_a_recording_without_frames_says_how_to_get_some(open_writer: Open, tmp_path: Path) -> None:
    writer = open_writer()
    writer.close()
    with pytest.raises(RecordingError, match=r"no raw CAN frames.*log encoders --raw"):
        export_can(read(writer.path), tmp_path / "bus.blf")


def test_nothing_is_overwritten(record_frames, tmp_path: Path) -> None:
    (tmp_path / "bus.asc").write_text("precious")
    with pytest.raises(RecordingError, match="nothing is overwritten"):
        export_can(record_frames(messages()), tmp_path / "bus.asc")


@pytest.mark.parametrize(
    ("suffix", "altered", "stamps"),
    [
        (".log", lambda raw: raw, "arrived"),
        (".csv", lambda raw: raw, "unknown"),
        (".blf", lambda raw: raw, "unknown"),  # by python-can, as exported
        (".blf", lambda raw: raw[:8] + bytes([2]) + raw[9:], "hardware"),  # by CANoe
        (".asc", lambda raw: raw, "unknown"),
        (
            ".asc",
            lambda raw: raw.replace(b"internal events logged", b"internal events logged\n// version 9.0.0"),
            "hardware",
        ),
    ],
)
def test_frames_have_the_kind_of_stamp_that_the_format_states(
    suffix: str, altered: Callable[[bytes], bytes], stamps: str, record_frames, tmp_path: Path, rig_source: str
) -> None:
    log = tmp_path / f"bus{suffix}"
    export_can(record_frames(messages()), log)
    log.write_bytes(altered(log.read_bytes()))
    assert import_can(log, tmp_path / "back.mcap", rig_text=rig_source, software="calibeam").frames == 1000
    (stream,) = read(tmp_path / "back.mcap").streams.values()
    assert stream.stamps == stamps
