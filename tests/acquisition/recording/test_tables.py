"""Tables of a recording read back bit for bit, with nothing in the place of nothing."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest

from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event, Recording
from acquisition.recording.session_folder import TableFormat, export
from acquisition.recording.session_folder.tables import write_tables

READERS = {TableFormat.CSV: pyarrow.csv.read_csv, TableFormat.PARQUET: pyarrow.parquet.read_table}
COUNT = 300


@pytest.fixture
def recorded(open_writer: Callable[..., RecordingWriter]) -> Recording:
    rng = np.random.default_rng(6)
    number = np.arange(COUNT)
    angle_rad = rng.normal(size=(COUNT, 2))
    angle_rad[17, 1] = np.nan
    channels = (Channel("position_rad", "rad", (2,), resolution=6e-6), Channel("emergency_code", "", (2,)))
    with open_writer() as writer:
        stream = writer.stream("encoders", channels)
        kept = np.delete(number, 100)
        values = {"position_rad": angle_rad[kept], "emergency_code": np.stack([kept, -kept], axis=1)}
        stream.append(1000.0 + kept / 3.0, kept / 3.0, kept, values)
        writer.event(Event(1001.0, "device, lost", {"why": 'a "plug"'}))
        writer.sample({"t_s": 1.0 / 3.0, "q1_rad": 0.1, "q2_rad": -0.2, "repeat": None, "temp_room_degC": 20.125})
        writer.sample({"t_s": 2.0 / 3.0, "q1_rad": 0.3, "q2_rad": -0.4, "repeat": 4})
    return read(writer.path)


@pytest.mark.parametrize("kind", TableFormat)
def test_streams_read_back_bit_for_bit(kind: TableFormat, recorded: Recording, tmp_path: Path) -> None:
    files = write_tables(recorded, tmp_path, kind)
    assert [file.name for file in files] == [f"{name}.{kind.value}" for name in ("encoders", "events", "gaps")]
    table, stream = READERS[kind](files[0]), recorded.streams["encoders"]
    assert table.column_names == [
        "host_s", "device_s", "sequence", "position_rad_1", "position_rad_2", "emergency_code_1", "emergency_code_2",
    ]  # fmt: skip
    np.testing.assert_array_equal(table["host_s"].to_numpy(), stream.host_s)
    for joint in (0, 1):
        expected = [None if np.isnan(value) else value for value in stream.values["position_rad"][:, joint].tolist()]
        assert table[f"position_rad_{joint + 1}"].to_pylist() == expected
    assert table["emergency_code_2"].to_pylist() == (-stream.sequence).tolist()


@pytest.mark.parametrize("kind", TableFormat)
def test_events_and_gaps_are_tables_too(kind: TableFormat, recorded: Recording, tmp_path: Path) -> None:
    _, events, gaps = write_tables(recorded, tmp_path, kind)
    assert READERS[kind](events).to_pylist() == [
        {"host_s": 1001.0, "kind": "device, lost", "detail_json": '{"why":"a \\"plug\\""}'}
    ]
    (gap,) = READERS[kind](gaps).to_pylist()
    assert (gap["stream"], gap["missing"]) == ("encoders", 1)


def test_parquet_columns_say_their_unit(recorded: Recording, tmp_path: Path) -> None:
    write_tables(recorded, tmp_path, TableFormat.PARQUET)
    field = pyarrow.parquet.read_schema(tmp_path / "encoders.parquet").field("position_rad_1")
    assert field.metadata == {b"unit": b"rad", b"resolution": b"6e-06"}


def test_a_session_folder_of_parquet_is_the_same_session(recorded: Recording, tmp_path: Path) -> None:
    export(recorded, tmp_path / "csv", TableFormat.CSV)
    export(recorded, tmp_path / "parquet", TableFormat.PARQUET)
    assert sorted(path.name for path in (tmp_path / "parquet").iterdir()) == ["rig.toml", "samples.parquet"]
    of_csv, of_parquet = read(tmp_path / "csv").samples, read(tmp_path / "parquet").samples
    assert of_csv.names == of_parquet.names == recorded.samples.names
    assert list(of_csv.rows()) == list(of_parquet.rows()) == list(recorded.samples.rows())
