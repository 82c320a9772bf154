"""fleet.parquet holds every row, to the last bit, and a journal keeps them whatever happens."""

import msgspec
import pyarrow.parquet as pq
import pytest

from acquisition.recording import RecordingError
from calibeam.fleet.recordings import JOURNAL
from calibeam.fleet.row import Cause, Outcome, Row, Zero
from calibeam.fleet.table import Journal, read_rows, write_rows

FULL = Row(
    path="/f/a.mcap",
    name="a.mcap",
    sha256="ab",
    size_bytes=12,
    modified_ns=1_700_000_000_123_456_789,
    outcome=Outcome.IDENTIFIED,
    software="calibeam 1",
    diagnosed=True,
    seconds=0.1,
    robot="7",
    started_utc="2026-01-02T03:04:05+00:00",
    samples=60,
    instruments=("position", "wire"),
    zeros=(Zero(1, None, None, "only in combination", 0.0), Zero(2, 0.1 + 0.2, 1e-6, "determined", -1.5)),
    noise={"position": 2e-5, "joint": 3e-6},
    held_out_after_m=1e-5,
    trust="yes",
    verdict="mismatch",
    causes=(Cause("joint3.angle", "q3", "harmonic", "encoder-eccentricity", 0.99, None, "says"),),
)
BARE = Row("/f/b.mcap", "b.mcap", "", 3, 5, Outcome.LOST, "calibeam 1", error="gone")


def test_rows_come_back_as_they_were(tmp_path):
    write_rows(tmp_path / "t.parquet", [BARE, FULL])
    assert read_rows(tmp_path / "t.parquet") == [FULL, BARE]


def test_each_number_is_a_column_with_its_unit(tmp_path):
    write_rows(tmp_path / "t.parquet", [FULL, BARE])
    plain = pq.read_table(tmp_path / "t.parquet").to_pylist()
    assert plain[0]["joint2_zero_rad"] == 0.1 + 0.2
    assert plain[0]["joint2_drawn_rad"] == -1.5
    assert plain[0]["joint1_zero_status"] == "only in combination"
    assert (plain[0]["noise_position_m"], plain[0]["noise_joint_rad"]) == (2e-5, 3e-6)
    assert plain[1]["joint2_zero_rad"] is None


def test_trust_of_an_older_table_is_on_the_scale_of_today(tmp_path):
    older = [msgspec.structs.replace(FULL, trust=word, path=word) for word in ("good", "care", "bad")]
    write_rows(tmp_path / "t.parquet", older)
    assert [row.trust for row in read_rows(tmp_path / "t.parquet")] == ["yes", "with care", "no"]


def test_a_table_of_another_program_is_refused(tmp_path):
    (tmp_path / "t.parquet").write_text("no table")
    with pytest.raises(RecordingError, match="choose another --out"):
        read_rows(tmp_path / "t.parquet")


def test_what_a_killed_run_had_done_stands(tmp_path):
    killed = Journal(tmp_path)
    killed.add(FULL)
    killed.add(BARE)
    killed._file.close()  # as the system does it for a killed process
    with (tmp_path / JOURNAL).open("ab") as file:
        file.write(b'{"path": "/f/torn')
    with Journal(tmp_path) as journal:
        assert journal.rows == (FULL, BARE)
    assert read_rows(tmp_path / "fleet.parquet") == [FULL, BARE]
    assert not (tmp_path / JOURNAL).exists()


def test_a_row_takes_the_place_of_the_last_one(tmp_path):
    with Journal(tmp_path) as journal:
        journal.add(BARE)
    newer = msgspec.structs.replace(FULL, path=BARE.path)
    with Journal(tmp_path) as journal:
        journal.add(newer)
        assert journal.rows == (newer,)


def test_two_runs_at_once_are_refused(tmp_path):
    with Journal(tmp_path), pytest.raises(RecordingError, match="another batch is at work"):
        Journal(tmp_path)
