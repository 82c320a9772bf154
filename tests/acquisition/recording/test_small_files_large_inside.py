"""Files that are small and hold far more than the memory: refused by what they state, before it is unpacked."""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mcap.writer import CompressionType, IndexType, Writer

from acquisition.recording.can_log import import_can
from acquisition.recording.errors import RecordingError, SamplesError
from acquisition.recording.files.bounds import TABLE_BYTES, TABLE_CELLS, TABLE_COLUMNS
from acquisition.recording.files.json_file import JsonKind, read_json
from acquisition.recording.foreign import read_sheet
from acquisition.recording.foreign.sheet import NUMBER
from acquisition.recording.mcap import scan
from acquisition.recording.mcap.scan import Scan
from acquisition.recording.recording import Recording
from acquisition.recording.rig import Rig, load_rig
from acquisition.recording.sample_rules import checked_samples, no_samples
from acquisition.recording.session_folder import parse_csv, read_csv, read_parquet
from acquisition.recording.session_folder.stream_tables import with_streams

RIG_FILE = Path(__file__).parents[3] / "rigs" / "ur5e-tracker.toml"
HEAD = "Time [s],A1 [deg],A2 [deg],X [mm]"


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(RIG_FILE)


def _sheet(path: Path, rig: Rig) -> Any:
    return read_sheet(path)


# --- CSV ---


def test_samples_of_too_many_cells_are_refused_where_the_bound_is_passed(rig: Rig) -> None:
    rows = TABLE_CELLS // 5
    with pytest.raises(SamplesError, match=rf"a\.csv line {rows + 2}: 4000005 cells up to here; .* give a part of it"):
        parse_csv("a,b,c,d,e\n" + ",,,,\n" * (rows + 9), "a.csv", rig)


def test_samples_of_too_many_columns_are_refused(rig: Rig) -> None:
    with pytest.raises(SamplesError, match=r"a\.csv line 1: 5000 columns; at most 4000 are read, remove those"):
        parse_csv(",".join(f"c{k}" for k in range(5000)), "a.csv", rig)


@pytest.mark.parametrize("read", [read_csv, _sheet])
def test_a_text_of_too_many_bytes_is_refused(read: Callable[[Path, Rig], Any], rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with path.open("wb") as file:
        file.truncate(TABLE_BYTES + 1)
    with pytest.raises(SamplesError, match=r"a\.csv: larger than 32 MB, the most of a table as text; give a part"):
        read(path, rig)


def test_one_long_text_does_not_widen_a_whole_column(rig: Rig) -> None:
    joints = {f"q{j + 1}_rad": [0.0] * 2 for j in range(6)}
    columns: dict[str, list[Any]] = {"t_s": [0.0, 1.0], **joints, "bar": [None, None], "bar_end": ["", "a" * 100_000]}
    with pytest.raises(SamplesError, match="bar_end"):
        checked_samples(columns, rig, str)


def test_a_foreign_table_of_too_many_cells_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    names = "".join(f",b{k}" for k in range(396))
    path.write_text(f"{HEAD}{names}\n" + ("1" + ",2" * 399 + "\n") * (TABLE_CELLS // 400))
    with pytest.raises(SamplesError, match=r"lab\.csv line 10001: 4000400 cells up to here"):
        read_sheet(path)


def test_rows_of_empty_cells_are_not_kept(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    path.write_text(f"{HEAD}\n1,2,3,4\n" + "," * 2000 + "\n" + ",,,\n" * 100 + "2,3,4,5" + "," * 3000)
    sheet = read_sheet(path)
    assert sheet.rows == (("1", "2", "3", "4"), ("2", "3", "4", "5"))
    assert sheet.lines == (2, 104)


def test_a_heading_of_a_thousand_letters_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    path.write_text(f"{HEAD},b{' ' * 999}b\n1,2,3,4,5\n")
    with pytest.raises(SamplesError, match=r"row 1: heading 'b .*' has 1001 letters; shorten it"):
        read_sheet(path)


def test_a_numeral_of_many_digits_is_read_once() -> None:
    """Not again from every digit on, which would take minutes."""
    assert NUMBER.fullmatch("1" * 1_000_000 + "x") is None
    assert NUMBER.fullmatch("1" * 1_000_000)


# --- Parquet ---


def _parquet(path: Path, **columns: Any) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


EQUAL = {
    "t_s": pa.repeat(0.0, TABLE_CELLS // 2),
    "q1_rad": pa.repeat(0.0, TABLE_CELLS // 2),
    "c": pa.repeat(0, 2_000_000),
}
TEXTS = {"t_s": pa.repeat(0.0, 50), "note": pa.repeat("a" * 100_000, 50)}
LARGE_TEXTS = {"t_s": pa.repeat(0.0, 50), "note": pa.repeat("a" * 100_000, 50).cast(pa.large_string())}
DICTIONARY = {"t_s": pa.repeat(0.0, 50), "note": pa.repeat("a" * 100_000, 50).dictionary_encode()}
LISTS = {"t_s": pa.repeat(0.0, 1000), "x_m": pa.repeat(pa.scalar([0.0] * 5000), 1000)}
WIDE = {f"c{k}": pa.array([0.0]) for k in range(TABLE_COLUMNS + 1)}


@pytest.mark.parametrize("read", [read_parquet, _sheet])
@pytest.mark.parametrize(
    ("columns", "lines"),
    [
        (EQUAL, r"6000000 cells up to here; at most 4000000 of a table are read, give a part of it"),
        (TEXTS, r"column 'note': a text of 100000 bytes; shorten it"),
        (LARGE_TEXTS, r"column 'note': a text of 100000 bytes; shorten it"),
        (DICTIONARY, r"column 'note': a text of 100000 bytes; shorten it"),
        (LISTS, r"5001000 cells up to here"),
        (WIDE, r"4001 columns; at most 4000 are read"),
    ],
    ids=["rows", "texts", "large texts", "dictionary", "lists", "columns"],
)
def test_parquet_is_refused_by_what_its_directory_states(
    columns: dict[str, Any], lines: str, read: Callable[[Path, Rig], Any], rig: Rig, tmp_path: Path
) -> None:
    path = _parquet(tmp_path / "a.parquet", **columns)
    assert path.stat().st_size < 1_500_000
    with pytest.raises(SamplesError, match=rf"a\.parquet.*{lines}"):
        read(path, rig)


def test_texts_of_parquet_are_read_as_they_stand(tmp_path: Path) -> None:
    columns = {"Time [s]": [0.0, 1.0], "A1 [deg]": [1.0, 2.0], "note": ["ok", None]}
    assert read_sheet(_parquet(tmp_path / "a.parquet", **columns)).rows == ((0.0, 1.0, "ok"), (1.0, 2.0, None))


def test_a_stream_as_parquet_is_refused_by_what_its_directory_states(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "streams").mkdir()
    equal = pa.repeat(0.0, 4_500_000)
    _parquet(tmp_path / "streams" / "a.parquet", **{f"c{k}": equal for k in range(8)})
    with pytest.raises(RecordingError, match=r"a\.parquet: 36000000 cells up to here; at most 32000000"):
        with_streams(_no_recording(rig), tmp_path)


def _no_recording(rig: Rig) -> Recording:
    return Recording(Path(), "", rig, no_samples(rig), complete=True)


# --- workbooks ---


def _workbook(path: Path, **members: bytes) -> Path:
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in (HEAD.split(","), [1, 2, 3, 4], [2, 3, 4, 5]):
        sheet.append(row)
    made = io.BytesIO()
    book.save(made)
    with zipfile.ZipFile(made) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            short = Path(name).stem
            data = old.read(name)
            new.writestr(name, data.replace(b"</sheetData>", members[short]) if short in members else data)
    return path


def test_a_cell_in_the_last_column_of_each_row_makes_no_row_of_16_384_cells(tmp_path: Path) -> None:
    cells = b"".join(b'<row r="%d"><c r="XFD%d" s="0"/></row>' % (k, k) for k in range(4, 500))
    sheet = read_sheet(_workbook(tmp_path / "a.xlsx", sheet1=cells + b"</sheetData>"))
    assert [len(row) for row in sheet.rows] == [4, 4]


def test_a_grid_of_too_many_cells_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("acquisition.recording.foreign.sheet_files.GRID_CELLS", 1_000_000)
    cells = b"".join(b'<row r="%d"><c r="XFD%d" s="0"/></row>' % (k, k) for k in range(4, 500))
    with pytest.raises(SamplesError, match=r"a\.xlsx sheet 'Sheet' row 65: 1015820 cells up to here"):
        read_sheet(_workbook(tmp_path / "a.xlsx", sheet1=cells + b"</sheetData>"))


def test_parts_that_nobody_reads_may_be_large(tmp_path: Path) -> None:
    path = _workbook(tmp_path / "a.xlsx")
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as book:
        book.writestr("xl/charts/chart1.xml", bytes(3_000_000))
    assert len(read_sheet(path).rows) == 2


@pytest.mark.parametrize(
    ("part", "unpacked", "most"),
    [("xl/theme/theme2.xml", 3_000_000, 2), ("xl/elsewhere.xml", 3_000_000, 2), ("xl/charts/c.xml", 129_000_000, 128)],
)
def test_a_part_of_a_workbook_that_unpacks_to_more_than_one_has_is_refused(
    part: str, unpacked: int, most: int, tmp_path: Path
) -> None:
    path = _workbook(tmp_path / "a.xlsx")
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as book:
        book.writestr(part, bytes(unpacked))
    with pytest.raises(SamplesError, match=rf"a\.xlsx: '{part}' has \d+ MB when unpacked, more than {most} MB"):
        read_sheet(path)


# --- recordings ---


def _recording(path: Path, messages: list[bytes]) -> Path:
    with path.open("wb") as file:
        writer = Writer(
            file, compression=CompressionType.ZSTD, chunk_size=10**9, index_types=IndexType.NONE,
            repeat_channels=False, repeat_schemas=False,
        )  # fmt: skip
        writer.start(profile="calibeam")
        channel = writer.register_channel("a", "", 0)
        for data in messages:
            writer.add_message(channel, 0, data, 0)
        writer.finish()
    return path


def test_a_batch_that_unpacks_to_more_than_one_has_is_left_out_and_reported(tmp_path: Path) -> None:
    path = _recording(tmp_path / "a.mcap", [bytes(65_000_000)])
    assert path.stat().st_size < 10_000
    read = Scan(path)
    assert not [one for one in read.records() if type(one).__name__ == "Message"]
    assert "a batch is damaged (65 MB when unpacked, at most 64 MB are read here) and was left out" in read.damage[0]


def test_so_is_one_that_states_a_smaller_size(tmp_path: Path) -> None:
    path = _recording(tmp_path / "a.mcap", [bytes(65_000_000)])
    data = bytearray(path.read_bytes())
    at = data.find(b"\x04\x00\x00\x00zstd") - 12
    data[at : at + 8] = (1000).to_bytes(8, "little")
    path.write_bytes(data)
    read = Scan(path)
    list(read.records())
    assert "65 MB when unpacked" in read.damage[0]


def test_messages_are_counted_before_they_become_objects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = _recording(tmp_path / "a.mcap", [b""] * 3000)
    monkeypatch.setattr(scan, "MESSAGES", 2000)
    read = Scan(path)
    assert not [one for one in read.records() if type(one).__name__ == "Message"]
    assert "hold more messages than a recording of this size" in read.damage[0]
    monkeypatch.setattr(scan, "MESSAGES", 4000)
    assert sum(type(one).__name__ == "Message" for one in Scan(path).records()) == 3000


def test_a_container_of_a_can_log_is_unpacked_within_its_bound(tmp_path: Path) -> None:
    path = tmp_path / "bus.blf"
    with can.BLFWriter(path) as writer:
        writer.on_message_received(can.Message(timestamp=1.79e9, arbitration_id=1, data=b"1"))
    packed = zlib.compress(bytes(65_000_000), 9)
    size = 32 + len(packed)
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, size, 10) + struct.pack("<H6xL4x", 2, 1000)
    path.write_bytes(path.read_bytes()[:144] + head + packed + bytes(size % 4))
    with pytest.raises(RecordingError, match=r"bus\.blf: no CAN frame in it \(.*byte 160: too much when unpacked"):
        import_can(path, tmp_path / "a.mcap", rig_text=RIG_FILE.read_text("utf-8"), software="test")


def test_every_frame_of_a_binary_log_is_taken_however_small_it_is_packed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("acquisition.recording.can_log.MESSAGES", 100)
    path = tmp_path / "bus.blf"
    with can.BLFWriter(path) as writer:
        for k in range(2000):
            writer.on_message_received(can.Message(timestamp=1.79e9 + 1e-3 * k, arbitration_id=1, data=bytes(8)))
    assert path.stat().st_size < 12 * 2000
    done = import_can(path, tmp_path / "a.mcap", rig_text=RIG_FILE.read_text("utf-8"), software="test")
    assert (done.frames, done.damage) == (2000, None)


# --- JSON ---


def test_lists_and_objects_without_number_are_counted_before_they_are_made(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    path.write_text(json.dumps({"more": [[]] * 500_001}))
    kind = JsonKind("model.json", "give one", "identify the recording again", RecordingError)
    with pytest.raises(RecordingError, match=r"model\.json: 500003 lists and objects, which no model\.json has; ident"):
        read_json(path, kind, dict[str, Any], lambda _: None)
