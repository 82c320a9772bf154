"""A session in several recordings of one folder: all samples together, times counted on, nothing mixed up."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.errors import RecordingError
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.session_parts import next_part, parts
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Event

RIG = (Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml").read_text()
BEGUN = datetime(2026, 3, 1, 8, 0, 0, tzinfo=UTC)
PLACE = "\n[[placement]]\nid = 4\npsd1_in_base = { origin_m = [0.5, 0.1, 0.1], rotation_rad = [0, 0, -1.5] }\n"


class Clock:
    def now_s(self) -> float:
        return 50.0


def row(t_s: float, placement: int) -> dict:
    joints = {f"q{i}_rad": 0.1 * i for i in range(1, 7)}
    spots = {"psd1_x_m": 1e-3, "psd1_y_m": 0.0, "psd2_x_m": 0.0, "psd2_y_m": 0.0}
    return {"t_s": t_s, **joints, "placement": placement, "first_psd": 1, **spots}


def write(path: Path, rows: list[dict], *, rig: str = RIG, days: int = 0, streams: bool = False) -> None:
    started = BEGUN + timedelta(days=days)
    with RecordingWriter(path, rig_text=rig, software="test", clock=Clock(), started_utc=started) as writer:
        if streams:
            writer.stream("psd", (Channel("flags", "1"),)).append([50.0], [1.0], [0], {"flags": [0]})
        for one in rows:
            writer.sample(one)
        writer.event(Event(51.0, "end", {}))


def test_the_parts_are_one_recording_and_time_goes_on(tmp_path) -> None:
    write(tmp_path / "recording.mcap", [row(0.0, 1), row(5.0, 1)], streams=True)
    assert next_part(tmp_path) == tmp_path / "recording-0002.mcap"
    write(next_part(tmp_path), [{**row(2.0, 4), "temp_psd_degC": 25.0}], rig=RIG + PLACE, days=1)
    assert next_part(tmp_path) == tmp_path / "recording-0003.mcap"
    both = read(tmp_path)
    assert both.samples.column("t_s").tolist() == [0.0, 5.0, 86402.0]
    assert both.samples.integers("placement", 0).tolist() == [1, 1, 4]
    assert np.isnan(both.samples.column("temp_psd_degC")[:2]).all()
    assert 4 in both.rig.placements
    assert both.complete
    assert both.streams == {}
    assert [event.host_s for event in both.events] == [51.0, 51.0 + 86400.0]


def test_one_part_keeps_its_streams(tmp_path) -> None:
    write(tmp_path / "recording.mcap", [row(0.0, 1)], streams=True)
    assert set(read(tmp_path).streams) == {"psd"}


def test_a_session_that_was_only_begun_counts_for_nothing(tmp_path) -> None:
    write(tmp_path / "recording.mcap", [])
    write(tmp_path / "recording-0002.mcap", [row(0.0, 1)])
    assert len(read(tmp_path).samples) == 1


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [("d_m = 0.1625", "d_m = 0.1626", r"\[arm\]"), ("0.55, 0.10, 0.15", "0.56, 0.10, 0.15", r"\[\[placement\]\] 1")],
)
def test_parts_of_different_rigs_are_refused(tmp_path, old, new, says) -> None:
    write(tmp_path / "recording.mcap", [row(0.0, 1)])
    assert old in RIG
    write(tmp_path / "recording-0002.mcap", [row(0.0, 1)], rig=RIG.replace(old, new, 1))
    with pytest.raises(RecordingError, match=f"no parts of one session: {says} of the rig has changed"):
        read(tmp_path)


def test_a_session_folder_stays_one(tmp_path) -> None:
    (tmp_path / "rig.toml").write_text(RIG)
    (tmp_path / "recording.mcap").write_bytes(b"of something else")
    names = list(row(0.0, 1))
    (tmp_path / "samples.csv").write_text(f"{','.join(names)}\n{','.join(map(str, row(0.0, 1).values()))}\n")
    assert len(read(tmp_path).samples) == 1


def test_an_empty_folder_has_no_parts(tmp_path) -> None:
    assert parts(tmp_path) == []
    assert next_part(tmp_path) == tmp_path / "recording.mcap"
