"""What counts as a recording, and what a name says."""

import pytest

from calibeam.fleet.recordings import content_sha256, find_recordings
from calibrate.errors import DataError


def names(root, but=None):
    return [one.name for one in find_recordings(root, but or root / "nowhere")]


def test_files_and_session_folders_are_found_in_the_order_of_their_names(folder):
    root = folder("b/2.mcap", "a.mcap", "c/rig.toml", "c/samples.csv", "c/streams/x.mcap", "d/rig.toml", "e/notes.txt")
    assert names(root) == ["a.mcap", "b/2.mcap", "c"]


def test_results_and_hidden_folders_are_left_out(folder):
    root = folder("a.mcap", "out/kept.mcap", ".trash/old.mcap")
    assert names(root, root / "out") == ["a.mcap"]


def test_a_folder_without_recordings_is_reported(folder, tmp_path):
    with pytest.raises(DataError, match="no recording"):
        find_recordings(folder("notes.txt"), tmp_path)
    with pytest.raises(DataError, match="no such folder"):
        find_recordings(tmp_path / "none", tmp_path)


def test_the_last_date_of_the_name_and_its_first_folder(folder):
    (one,) = find_recordings(folder("robot-7/2024-01-02/2025-03-04 after crash.mcap"), folder())
    assert (one.date, one.group) == ("2025-03-04", "robot-7")
    (other,) = find_recordings(folder() / "robot-7" / "2024-01-02", folder())
    assert (other.date, other.group) == ("2025-03-04", "")


@pytest.mark.parametrize(
    ("name", "date"),
    [("SN-4711-12-30.mcap", ""), ("2025-13-05.mcap", ""), ("2025-02-30 of 2025-03-04.mcap", "2025-03-04")],
)
def test_what_only_looks_like_a_date_is_none(folder, name, date):
    root = folder(name)
    assert [one.date for one in find_recordings(root, root / "nowhere")] == [date]


def test_the_parts_of_a_session_are_one_recording(folder):
    root = folder("r7/recording.mcap", "r7/other.mcap", "r7/below/x.mcap", "r8/recording.mcap")
    before = content_sha256(root / "r7")
    folder("r7/recording-0002.mcap")
    assert names(root) == ["r7/below/x.mcap", "r7/other.mcap", "r7/recording.mcap", "r8/recording.mcap"]
    whole = find_recordings(root, root / "nowhere")[2]
    assert (whole.path, whole.group) == (root / "r7", "r7")
    assert whole.size_bytes == len("r7/recording.mcap") + len("r7/recording-0002.mcap")
    assert content_sha256(whole.path) != before


def test_content_is_recognised_by_content_alone(folder):
    root = folder("a.mcap", "b.mcap", "c/rig.toml", "c/samples.csv")
    (root / "b.mcap").write_text("a.mcap")
    assert content_sha256(root / "a.mcap") == content_sha256(root / "b.mcap")
    before = content_sha256(root / "c")
    (root / "c" / "samples.csv").write_text("other")
    assert content_sha256(root / "c") != before
