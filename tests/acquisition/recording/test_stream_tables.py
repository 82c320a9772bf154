"""What `export --streams` wrote is read back bit for bit; tables of other programs come in as streams."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event, Gap, Recording, Stream
from acquisition.recording.session_folder import TableFormat, export, write_streams
from acquisition.recording.session_folder.folder_import import import_folder

COUNT = 2500  # more than a block


@pytest.fixture
def recorded(open_writer: Callable[..., RecordingWriter]) -> Recording:
    rng = np.random.default_rng(6)
    kept = np.delete(np.arange(COUNT), 100)
    angle_rad = rng.normal(size=(len(kept), 2))
    angle_rad[17, 1], angle_rad[18, 1], angle_rad[19, 1] = np.nan, -0.0, np.inf
    channels = (
        Channel("position_rad", "rad", (2,), full_scale=6.3, resolution=6e-6),
        Channel("frame", "", (1, 2)),
        Channel("whole_v", "V"),
    )
    with open_writer(notes={"operator": 'A, "B"\nC'}) as writer:
        values = {
            "position_rad": angle_rad,
            "frame": np.stack([kept + 2**60, -kept], axis=1)[:, None, :],
            "whole_v": np.round(angle_rad[:, 0]),
        }
        writer.stream("encoders", channels).append(1000.0 + kept / 3.0, np.full(len(kept), np.nan), kept, values)
        writer.stream("events", (Channel("x_m", "m"),)).append([1001.0], [0.5], [7], {"x_m": [0.1]})
        silent = writer.stream("silent", (Channel("y_m", "m"),))
        silent.gap(Gap(1000.0, 1005.0, -1, 'cable, "pulled"'))
        writer.event(Event(1001.0, "device, lost", {"why": 'a "plug"\n', "values": [1.0, None]}))
        writer.event(Event(1002.0, "NA", {}))
        writer.sample({"t_s": 1.0 / 3.0, "q1_rad": 0.1, "q2_rad": -0.2})
        writer.close(complete=False)
    return read(writer.path)


@pytest.fixture
def folder(recorded: Recording, tmp_path: Path) -> Path:
    export(recorded, tmp_path / "session", TableFormat.CSV)
    write_streams(recorded, tmp_path / "session", TableFormat.CSV)
    return tmp_path / "session"


def bits(stream: Stream) -> dict[str, bytes]:
    arrays = {"host_s": stream.host_s, "device_s": stream.device_s, "sequence": stream.sequence, **stream.values}
    return {name: array.tobytes() for name, array in arrays.items()}


@pytest.mark.parametrize("kind", TableFormat)
def test_export_and_import_give_the_same_recording(kind: TableFormat, recorded: Recording, tmp_path: Path) -> None:
    export(recorded, tmp_path / "session", kind)
    write_streams(recorded, tmp_path / "session", kind)
    import_folder(tmp_path / "session", tmp_path / "again.mcap", software="calibeam")
    again = read(tmp_path / "again.mcap")
    assert list(again.streams) == list(recorded.streams)
    for name, stream in recorded.streams.items():
        assert again.streams[name].channels == stream.channels
        assert bits(again.streams[name]) == bits(stream)
        assert again.streams[name].gaps == stream.gaps
    assert again.events == recorded.events
    assert again.notes == {**recorded.notes, "imported_from": "session"}
    for field in ("software", "host", "started_utc", "host_s0", "complete"):
        assert getattr(again, field) == getattr(recorded, field)


def test_a_folder_with_streams_is_read_without_an_import(folder: Path, recorded: Recording) -> None:
    assert bits(read(folder).streams["encoders"]) == bits(recorded.streams["encoders"])


def test_tables_of_another_program_are_streams(folder: Path) -> None:
    shutil.rmtree(folder / "streams")
    (folder / "streams").mkdir()
    (folder / "streams" / "arm.csv").write_text("t_s,q1_rad,q1_rad_s,note_1\n0.5,1e-3,,2\n0.75,2e-3,NaN,3\n")
    (arm,) = read(folder).streams.values()
    assert arm.channels == (Channel("q1_rad", "rad"), Channel("q1_rad_s", "rad/s"), Channel("note_1", ""))
    np.testing.assert_array_equal(arm.host_s, [0.5, 0.75])
    np.testing.assert_array_equal(arm.sequence, [0, 1])
    np.testing.assert_array_equal(arm.values["q1_rad"], [1e-3, 2e-3])
    assert np.isnan(arm.values["q1_rad_s"]).all()


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("host_s,", "host,", "no column 'host_s'"),
        ("position_rad_2", "position_rad_3", "no column 'position_rad_2', which streams.json declares"),
        ("position_rad_2", "position_rad_1", "column 'position_rad_1' stands twice"),
        ("\n1000,,0,", "\n1000,,0.5,", "row 1, column 'sequence': 0.5 is not a whole number"),
        ("\n1000,,0,", "\n1000,,,", "row 1, column 'sequence': an empty cell is not a whole number"),
        ("\n1000,,0,", "\nsoon,,0,", "row 1, column 'host_s': soon is not a number"),
        ("\n1000,,0,", "\n,,0,", "row 1, column 'host_s': nan"),
        ("\n1000,,0,", "\n1e10,,0,", "row 1, column 'host_s': 10000000000 s"),
        ("\n1000,,0,", "\n1000,,0,1,", "cannot be read as a table"),
    ],
)
def test_a_damaged_table_is_named_with_row_and_column(folder: Path, old: str, new: str, named: str) -> None:
    path = folder / "streams" / "encoders.csv"
    text = path.read_text().replace('"', "")
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(RecordingError) as error:
        read(folder)
    assert named in str(error.value)
    assert "encoders.csv" in str(error.value)


def test_a_table_that_is_not_there_is_named(folder: Path) -> None:
    (folder / "streams" / "silent.csv").unlink()
    with pytest.raises(RecordingError, match=r"no silent\.csv or silent\.parquet, which streams\.json names"):
        read(folder)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"kind": "calibeam-model"}, "kind is not calibeam-streams"),
        ({"schema": 2}, "schema = 2"),
        ({"host_s0": 1e300}, "host_s0 = 1e+300"),
        ({"started_utc": "yesterday"}, "started_utc = yesterday is no ISO 8601 time"),
        ({"streams": [{"name": "a b", "channels": []}]}, "stream 'a b'"),
    ],
)
def test_a_damaged_streams_json_is_refused(folder: Path, tmp_path: Path, change: dict[str, object], named: str) -> None:
    path = folder / "streams" / "streams.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(RecordingError) as error:
        import_folder(folder, tmp_path / "again.mcap", software="calibeam")
    assert named in str(error.value)
    assert not (tmp_path / "again.mcap").exists()


def test_a_gap_of_more_samples_than_there_can_be_is_refused(folder: Path) -> None:
    path = folder / "streams" / "gaps.csv"
    path.write_text(path.read_text().replace(",-1,", f",{10**20},"))
    with pytest.raises(RecordingError, match="row 2: no gap"):
        read(folder)
