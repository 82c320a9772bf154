"""Session folders: into a recording and out again, and what is refused."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.errors import RecordingError, RigFileError, SamplesError
from acquisition.recording.mcap.read import read
from acquisition.recording.session_folder import export
from acquisition.recording.session_folder.folder_import import import_folder

CSV = "t_s,q1_rad,q2_rad,humidity %,temp_a_degC,temp_A_degC\n0.1,0.30000000000000004,-2.0,,20.25,1e-300\n7,1,2,40.5,,\n"


@pytest.fixture
def folder(tmp_path: Path, rig_source: str) -> Path:
    made = tmp_path / "session"
    made.mkdir()
    (made / "rig.toml").write_text(rig_source)
    (made / "samples.csv").write_text(CSV)
    return made


def test_a_folder_survives_the_way_through_a_recording(folder: Path, tmp_path: Path) -> None:
    recording = tmp_path / "session.mcap"
    import_folder(folder, recording, software="calibeam 0.1.0", started_utc=datetime(2026, 1, 2, tzinfo=UTC))
    export(read(recording), tmp_path / "out" / "again")
    before, after = read(folder), read(tmp_path / "out" / "again")
    assert after.rig_text == before.rig_text
    assert after.samples.names == before.samples.names
    for name in before.samples.names:
        np.testing.assert_array_equal(after.samples.columns[name], before.samples.columns[name])
    assert read(recording).complete
    assert read(recording).started_utc == "2026-01-02T00:00:00+00:00"


def test_line_ends_of_the_rig_are_kept(folder: Path, tmp_path: Path, rig_source: str) -> None:
    text = rig_source.replace("\n", "\r\n").encode()
    (folder / "rig.toml").write_bytes(text)
    export(read(folder), tmp_path / "again")
    assert (tmp_path / "again" / "rig.toml").read_bytes() == text


def test_nothing_is_overwritten(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="the folder is not empty"):
        export(read(folder), folder)
    (tmp_path / "taken.mcap").write_bytes(b"precious")
    with pytest.raises(RecordingError, match="the file exists; a recording is never overwritten"):
        import_folder(folder, tmp_path / "taken.mcap", software="calibeam")
    assert (tmp_path / "taken.mcap").read_bytes() == b"precious"


def test_export_to_a_file_is_refused(folder: Path) -> None:
    with pytest.raises(RecordingError, match="cannot write the session folder"):
        export(read(folder), folder / "rig.toml")


def test_a_folder_names_what_it_lacks(folder: Path) -> None:
    (folder / "samples.csv").rename(folder / "samples.txt")
    with pytest.raises(RecordingError, match=r"no samples.csv or samples.parquet in the folder"):
        read(folder)
    (folder / "rig.toml").unlink()
    with pytest.raises(RecordingError, match=r"no rig.toml in the folder"):
        read(folder)


def test_two_tables_in_one_folder_are_refused(folder: Path) -> None:
    (folder / "samples.parquet").write_bytes(b"PAR1")
    with pytest.raises(RecordingError, match="remove the one that is not meant"):
        read(folder)


def test_errors_name_the_file_in_the_folder(folder: Path) -> None:
    (folder / "samples.csv").write_text(CSV.replace("7,1,2", "7,one,2"))
    with pytest.raises(SamplesError, match=r"session/samples.csv row 2 \(line 3\), column 'q1_rad'"):
        read(folder)
    (folder / "rig.toml").write_text("schema = 1\nnmae = 'x'\n")
    with pytest.raises(RigFileError, match=r"session/rig.toml line 2: unknown key 'nmae'"):
        read(folder)
