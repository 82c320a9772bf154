"""A recording written and read back: streams, gaps, samples, events, and what stands at the start of the file."""

import hashlib
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.errors import RecordingError, RigFileError, SamplesError
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event, Gap

Open = Callable[..., RecordingWriter]

SPOT = Channel("spot_x_m", "m", (), 0.01, 1e-7)
JOINTS = Channel("q_rad", "rad", (2,))
FLAGS = Channel("flags", "")


def append(stream: object, first: int, count: int, rate_hz: float = 1000.0) -> None:
    """Samples number first ... first + count - 1; their values tell their number."""
    sequence = np.arange(first, first + count)
    time_s = 1000.0 + sequence / rate_hz
    values = {
        "spot_x_m": sequence * 1e-6,
        "q_rad": np.stack([sequence, -sequence], axis=1) * 0.1,
        "flags": sequence % 2,
    }
    stream.append(time_s, time_s - 990.0, sequence, values)  # type: ignore[attr-defined]


def test_streams_come_back_as_they_were_measured(open_writer: Open) -> None:
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT, JOINTS, FLAGS))
        for first in range(0, 1000, 7):
            append(stream, first, 7)
    recording = read(writer.path)
    psd = recording.streams["psd"]
    number = np.arange(1001)
    assert recording.complete
    assert recording.damage == ()
    assert psd.channels == (SPOT, JOINTS, FLAGS)
    np.testing.assert_array_equal(psd.sequence, number)
    np.testing.assert_array_equal(psd.host_s, 1000.0 + number / 1000.0)
    np.testing.assert_array_equal(psd.device_s, 1000.0 + number / 1000.0 - 990.0)
    np.testing.assert_array_equal(psd.values["q_rad"], np.stack([number, -number], axis=1) * 0.1)
    np.testing.assert_array_equal(psd.values["flags"], number % 2)
    assert psd.values["flags"].dtype == np.int64
    assert psd.gaps == ()


def test_a_jump_of_the_sequence_becomes_a_gap(open_writer: Open) -> None:
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT, JOINTS, FLAGS))
        append(stream, 0, 10)
        append(stream, 13, 10)  # three lost between two blocks
        sequence = np.array([23, 30])  # six lost within one
        stream.append(
            [1000.023, 1000.030], [0, 0], sequence, {"spot_x_m": [0, 0.0], "q_rad": np.zeros((2, 2)), "flags": [0, 0]}
        )
        append(stream, 5, 1)  # the device began again
        stream.gap(Gap(1001.0, 1002.5, -1, "cable pulled"))
    gaps = read(writer.path).streams["psd"].gaps
    assert [(gap.missing, round(gap.from_s, 6), round(gap.to_s, 6)) for gap in gaps] == [
        (3, 1000.009, 1000.013),
        (6, 1000.023, 1000.030),
        (-1, 1000.030, 1000.005),
        (-1, 1001.0, 1002.5),
    ]
    assert gaps[0].reason == "the sequence jumped from 9 to 13"
    assert gaps[2].reason == "the sequence went back from 30 to 5: restarted"


def test_a_stream_that_stays_silent_is_there_and_empty(open_writer: Open) -> None:
    with open_writer() as writer:
        writer.stream("encoders", (JOINTS,))
    encoders = read(writer.path).streams["encoders"]
    assert encoders.host_s.size == 0
    assert encoders.values["q_rad"].shape == (0, 2)


def test_the_file_says_where_it_comes_from(open_writer: Open, rig_source: str) -> None:
    started = datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC)
    with open_writer(notes={"seed": "11"}, started_utc=started, host="bench-pc") as writer:
        pass
    recording = read(writer.path)
    assert recording.rig_text == rig_source
    assert recording.rig.name == "two-joint"
    assert recording.notes == {"seed": "11"}
    assert (recording.software, recording.host, recording.host_s0) == ("calibeam 0.1.0", "bench-pc", 1000.0)
    assert recording.started_utc == "2026-03-04T05:06:07+00:00"
    head = writer.path.read_bytes()[: len(rig_source) + 1000]
    assert rig_source.encode() in head
    assert hashlib.sha256(rig_source.encode()).hexdigest().encode() in head


def test_samples_keep_their_cells_and_may_gain_columns(open_writer: Open) -> None:
    first = {"t_s": 0.5, "q1_rad": 0.1, "q2_rad": np.float64(0.2), "repeat": None, "approach1": np.int64(-1)}
    second = {"t_s": 1.5, "q1_rad": 0.3, "q2_rad": 0.4, "temp_room_degC": 20.5, "bar": 3, "bar_end": "b"}
    with open_writer() as writer:
        writer.sample(first)
        writer.sample(second)
        writer.sample(first | {"q1_rad": -0.0, "temp_room_degC": float("nan")})
    rows = list(read(writer.path).samples.rows())
    assert rows[0] == first | {"temp_room_degC": None, "bar": None, "bar_end": None}
    assert rows[1] == second | {"repeat": None, "approach1": None}
    assert rows[2]["temp_room_degC"] is None
    assert np.signbit(rows[2]["q1_rad"])


def test_a_sample_that_could_not_be_read_back_is_refused_at_once(open_writer: Open) -> None:
    with open_writer() as writer:
        writer.sample({"t_s": 0.0, "q1_rad": 0.0, "q2_rad": 0.0})
        with pytest.raises(SamplesError, match=r"session.mcap sample 2, column 'q2_rad': the value is missing"):
            writer.sample({"t_s": 0.0, "q1_rad": 0.0, "q2_rad": None})
    assert len(read(writer.path).samples) == 1


def test_events_keep_their_detail(open_writer: Open) -> None:
    with open_writer() as writer:
        writer.event(
            Event(1000.25, "servo", {"step": 3, "spots_m": np.array([1e-3, 0.0]), "status": "CENTRED", "at": {"id": 1}})
        )
        with pytest.raises(TypeError, match="detail holds object"):
            writer.event(Event(1000.5, "bad", {"what": object()}))
        with pytest.raises(ValueError, match="host_s = nan"):
            writer.event(Event(float("nan"), "bad", {}))
    detail = {"step": 3, "spots_m": [1e-3, 0.0], "status": "CENTRED", "at": {"id": 1}}
    assert read(writer.path).events == (Event(1000.25, "servo", detail),)


def test_a_session_cut_short_is_not_complete(open_writer: Open) -> None:
    def cut_short(writer: RecordingWriter) -> None:
        with writer:
            writer.sample({"t_s": 0.0, "q1_rad": 0.0, "q2_rad": 0.0})
            raise KeyboardInterrupt

    writer = open_writer()
    with pytest.raises(KeyboardInterrupt):
        cut_short(writer)
    recording = read(writer.path)
    assert not recording.complete
    assert recording.damage == ()
    assert len(recording.samples) == 1


def test_many_threads_lose_nothing(open_writer: Open) -> None:
    writer = open_writer()
    streams = [writer.stream(f"device-{number}", (SPOT, JOINTS, FLAGS)) for number in range(3)]
    shared = writer.stream("shared", (SPOT,))
    together = threading.Barrier(4)

    def measure(number: int) -> None:
        together.wait(10.0)
        for first in range(0, 2000, 20):
            append(streams[number], first, 20)
            mine = np.full(5, number)
            shared.append(np.full(5, 1000.0), mine, mine, {"spot_x_m": first + np.arange(5.0)})

    threads = [threading.Thread(target=measure, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    together.wait(10.0)
    for number in range(50):
        writer.sample({"t_s": float(number), "q1_rad": 0.0, "q2_rad": 0.0})
        writer.event(Event(1000.0 + number, "tick", {"number": number}))
    for thread in threads:
        thread.join(30.0)
    writer.close()
    recording = read(writer.path)
    for number in range(3):
        np.testing.assert_array_equal(recording.streams[f"device-{number}"].sequence, np.arange(2000))
        of_this_thread = recording.streams["shared"].sequence == number
        expected = (np.arange(0, 2000, 20)[:, None] + np.arange(5.0)).reshape(-1)
        np.testing.assert_array_equal(recording.streams["shared"].values["spot_x_m"][of_this_thread], expected)
    assert recording.samples.column("t_s").tolist() == list(range(50))
    assert [event.detail["number"] for event in recording.events] == list(range(50))


def test_flush_puts_everything_on_the_disk_while_the_session_goes_on(open_writer: Open) -> None:
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT, JOINTS, FLAGS))
        append(stream, 0, 250)
        writer.flush()
        growing = read(writer.path)
        assert growing.streams["psd"].sequence.tolist() == list(range(250))
        assert not growing.complete


def test_nothing_can_be_added_after_close(open_writer: Open) -> None:
    writer = open_writer()
    stream = writer.stream("psd", (SPOT, JOINTS, FLAGS))
    writer.close()
    writer.close()
    with pytest.raises(RecordingError, match="the recording is closed"):
        append(stream, 0, 1)
    assert read(writer.path).complete


def test_the_caller_may_reuse_its_buffers(open_writer: Open) -> None:
    buffer = np.arange(4.0)
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT,))
        stream.append(buffer, buffer, np.arange(4), {"spot_x_m": buffer})
        buffer[:] = -1.0
    psd = read(writer.path).streams["psd"]
    assert psd.values["spot_x_m"].tolist() == psd.host_s.tolist() == psd.device_s.tolist() == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({}, "channel 'spot_x_m' was declared but is not in the block"),
        ({"spot_x_m": [1.0, 2.0], "more": [1.0, 2.0]}, "channel 'more' was not declared"),
        ({"spot_x_m": [1.0]}, r"channel 'spot_x_m' has shape \(1,\), expected \(2,\)"),
        ({"spot_x_m": ["a", "b"]}, "channel 'spot_x_m' holds <U1, not numbers"),
        ({"spot_x_m": np.array([1, 2**64 - 1], dtype=np.uint64)}, "beyond 64 bits with sign"),
    ],
)
def test_a_block_that_does_not_fit_its_declaration_is_refused(
    open_writer: Open, values: dict[str, object], says: str
) -> None:
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT,))
        with pytest.raises(ValueError, match=says):
            stream.append([0.0, 1.0], [0.0, 1.0], [0, 1], values)  # type: ignore[arg-type]


def test_a_block_without_a_finite_host_time_is_refused(open_writer: Open) -> None:
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT,))
        with pytest.raises(ValueError, match="host_s is not finite"):
            stream.append([np.nan], [0.0], [0], {"spot_x_m": [1.0]})
        with pytest.raises(ValueError, match=r"sequence has shape \(2,\), host_s \(1,\)"):
            stream.append([0.0], [0.0], [0, 1], {"spot_x_m": [1.0]})


def test_a_channel_does_not_change_between_whole_and_real_numbers(open_writer: Open) -> None:
    with open_writer() as writer:
        stream = writer.stream("psd", (SPOT,))
        stream.append([0.0], [0.0], [0], {"spot_x_m": [1]})
        with pytest.raises(ValueError, match="held whole numbers in one block, real ones in another"):
            stream.append([0.0], [0.0], [1], {"spot_x_m": [1.5]})


@pytest.mark.parametrize(
    ("name", "channels", "says"),
    [
        ("p s d", (SPOT,), "a name is letters, digits"),
        ("psd", (Channel("spot x", "m"),), "channel 'spot x' is not letters"),
        ("psd", (SPOT, SPOT), "channel 'spot_x_m' is declared twice"),
        ("psd", (Channel("host_s", "s"),), "is one of"),
        ("psd", (SPOT, Channel("spot_X_m", "m")), "differs from another name only in case and _"),
    ],
)
def test_names_that_cannot_stand_in_the_file_are_refused(
    open_writer: Open, name: str, channels: tuple[Channel, ...], says: str
) -> None:
    with open_writer() as writer, pytest.raises(ValueError, match=says):
        writer.stream(name, channels)


def test_a_stream_is_declared_once_and_its_viewer_knows_its_channels(open_writer: Open) -> None:
    with open_writer() as writer:
        writer.stream("psd", (SPOT,))
        with pytest.raises(ValueError, match="declared twice"):
            writer.stream("psd", (SPOT,))
        with pytest.raises(ValueError, match="the viewer asks for 'spot_y_m'"):
            writer.stream("other", (SPOT,), viewer=("spot_y_m",))


def test_a_bad_rig_or_place_leaves_no_file_behind(open_writer: Open, tmp_path: Path) -> None:
    with pytest.raises(RigFileError, match=r"session.mcap \(rig\) line 1"):
        open_writer(rig_text="schema = 3")
    with pytest.raises(RecordingError, match="cannot create the recording"):
        open_writer(tmp_path / "nowhere" / "session.mcap")
    assert list(tmp_path.iterdir()) == []
