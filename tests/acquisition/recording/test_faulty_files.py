"""What is damaged or out of all bounds ends in one short error with file, place, value and remedy."""

from pathlib import Path

import can
import pytest

from acquisition.recording.can_log import export_can, import_can
from acquisition.recording.errors import MESSAGE_LENGTH, VALUE_LENGTH, RecordingError, RigFileError, SamplesError, shown
from acquisition.recording.files.bounds import most_of
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel
from acquisition.recording.rig import load_rig, parse_rig
from acquisition.recording.session_folder import TableFormat
from acquisition.recording.session_folder.tables import parse_csv, write_tables

RIG = """schema = 1
name = "two-joint"
[arm]
model = "dh"
[[arm.joint]]
a_m = 0.3
alpha_rad = 0.0
d_m = 0.1
lower_rad = -3.0
upper_rad = 3.0
gear_ratio = 100.0
[[arm.joint]]
a_m = 0.2
alpha_rad = 1.5
d_m = 0.0
lower_rad = -2.0
upper_rad = 2.0
[emulation]
tremor_rad = 1e-5
"""


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "gear_ratio = 100.0",
            "gear_ratio = 1e308",
            "line 11: gear_ratio = 1e+308 in [[arm.joint]]: expected float <=",
        ),
        ("d_m = 0.1", "d_m = 1e5", "line 8: d_m = 100000.0 in [[arm.joint]]: expected float <= 20.0; write it in m"),
        ("tremor_rad = 1e-5", "tremor_rad = 1e200", "line 19: tremor_rad = 1e+200 in [emulation]: expected at most"),
        ("two-joint", "x" * 10**6, "line 2: name = 'xxxxx"),
        ("tremor_rad", "x" * 10**6, "line 19: unknown key 'xxxxx"),
        ("a_m = 0.3", f"a_m = {'9' * 5000}", "not TOML: Exceeds the limit"),
        ("a_m = 0.3", f"a_m = 0x{'f' * 5000}", "line 6: a_m = a int that is too large to show"),
        ("a_m = 0.3", f"a_m = {'[' * 5000}{']' * 5000}", "within each other, hundreds deep"),
        ("a_m = 0.3", f"{'a.' * 5000}b = 1", "line 6: 'a.a.a."),
        ("two-joint", "x" * 10**7, "larger than 4 MB, which no rig file is"),
    ],
)
def test_a_rig_beyond_all_bounds_is_refused_in_one_short_message(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG.replace(old, new, 1))
    with pytest.raises(RigFileError) as refused:
        load_rig(path)
    lines = str(refused.value).replace(str(tmp_path), ".")
    assert says in lines
    assert len(lines) <= MESSAGE_LENGTH


def test_a_rig_that_is_not_utf8_is_refused_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_bytes(RIG.encode().replace(b"two-joint", b"two\xffjoint"))
    with pytest.raises(RigFileError, match="line 2: byte 22 is not UTF-8; save the rig file as UTF-8"):
        load_rig(path)


@pytest.mark.parametrize(
    ("header", "row", "says"),
    [
        ("t_s,q1_rad,q2_rad", "0,1e30,0", "row 2 (line 3), column 'q1_rad': 1e+30 is beyond 100000, the most"),
        ("t_s,q1_rad,q2_rad", "1e308,1e308,1e308", "row 2 (line 3), column 't_s': 1e+308 is beyond"),
        ("t_s,q1_rad,q2_rad,wire_m", "0,0,0,1e30", "row 2 (line 3), column 'wire_m': 1e+30 is beyond 1000, the most"),
        ("t_s,q1_rad,q2_rad,other", "0,0,0,1e30", "row 2 (line 3), column 'other': 1e+30 is beyond 1e+20, the most"),
        ("t_s,q1_rad,q2_rad", "0,\u0661,0", "row 2 (line 3), column 'q1_rad': '\u0661' is not a number"),
        ("t_s,q\uff11_rad,q2_rad", "0,0,0", "column 'q1_rad': the column is missing"),
        ("t_s,q1_rad,q2_rad", f"0,{'x' * 10**5},0", "row 2 (line 3), column 'q1_rad': 'xxx"),
        (f"t_s,q1_rad,q2_rad,{'y' * 10**5}", "0,0,0,0", "the name has 100000 characters; at most 200 are read"),
    ],
)
def test_a_cell_beyond_all_bounds_is_refused_with_row_and_column(header: str, row: str, says: str) -> None:
    good = ",".join("0" for _ in header.split(","))
    with pytest.raises(SamplesError) as refused:
        parse_csv(f"{header}\n{good}\n{row}\n", "samples.csv", parse_rig(RIG, "rig.toml"))
    assert says in str(refused.value)
    assert len(str(refused.value)) <= MESSAGE_LENGTH


def test_a_bound_goes_by_the_unit_and_spares_counters_and_marks_of_no_reading() -> None:
    assert most_of("x_m") == most_of("target7_x_m") == 1e3
    assert most_of("q1_rad") == 1e5 > most_of("wire_m")
    assert most_of("temp_room_degC") > 999.0
    assert most_of("utc_ns") > 2**64


@pytest.mark.parametrize(
    "value", ["x" * 10**7, ["x" * 10**7], 16**5000, "a\nb\x1b[31m"], ids=["text", "list", "integer", "control"]
)
def test_a_value_is_shown_on_one_line_and_cut(value: object) -> None:
    assert len(shown(value)) <= VALUE_LENGTH
    assert shown(value).isprintable()


@pytest.mark.parametrize("stamp", ["12345678901234567890.5", "99999999999.0"])
def test_time_stamps_that_no_clock_shows_end_an_import_and_keep_what_came_before(tmp_path: Path, stamp: str) -> None:
    log = tmp_path / "bus.log"
    log.write_text(f"(1700000000.0) can0 123#01\n(1700000001.0) can0 123#02\n({stamp}) can0 123#03\n")
    done = import_can(log, tmp_path / "bus.mcap", rig_text=RIG, software="test")
    assert done.frames == 2
    assert done.damage is not None
    assert "after 2 frames the file makes no sense (ValueError: time stamp" in done.damage
    out = tmp_path / "out.log"
    assert export_can(read(tmp_path / "bus.mcap"), out) == 2
    with can.CanutilsLogReader(out) as messages:
        assert [message.data[0] for message in messages] == [1, 2]


def test_a_recording_cut_anywhere_in_its_first_records_is_exported_or_refused(tmp_path: Path) -> None:
    class Clock:
        def now_s(self) -> float:
            return 0.0

    whole = tmp_path / "whole.mcap"
    with RecordingWriter(whole, rig_text=RIG, software="test", clock=Clock()) as writer:
        writer.stream("pair", (Channel("volts", "V", (2,)),), viewer=())
        writer.stream("one", (Channel("count", ""),), viewer=())
    data = whole.read_bytes()
    refused = exported = 0
    for size in range(0, len(data), 7):
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(data[:size])
        try:
            recording = read(cut)
        except RecordingError:
            refused += 1
            continue
        folder = tmp_path / str(size)
        folder.mkdir()
        write_tables(recording, folder, TableFormat.CSV)
        exported += 1
    assert refused > 10
    assert exported > 10
