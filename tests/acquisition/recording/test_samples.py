"""samples.csv: what is read, what is refused and how, and that nothing is lost on the way out and in."""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acquisition.recording.errors import SamplesError
from acquisition.recording.rig import Rig, load_rig
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import Samples
from acquisition.recording.session_folder import read_csv, read_parquet, write_csv
from acquisition.recording.session_folder.tables import parse_csv

CSV = """\
t_s,q1_rad,q2_rad,placement,first_psd,psd1_x_m,psd1_y_m,psd2_x_m,psd2_y_m,enc1_rad,enc2_rad,bar,bar_end,temp_room_degC
0.0,0.1,0.2,1,2,1e-3,2e-3,3e-3,4e-3,0.11,,,,20.5
1.5,-0.1,0.3,,,,,,,,,3,a,
2.5,-0.1,0.4,7,1,0,0,0,0,,,,,21
"""


@pytest.fixture
def parse(rig: Rig) -> Callable[[str], Samples]:
    return lambda text: parse_csv(text, "s/samples.csv", rig)


def test_columns_are_read_by_name_and_missing_cells_are_nan(parse: Callable[[str], Samples]) -> None:
    samples = parse(CSV)
    assert len(samples) == 3
    assert samples.joints(2).tolist() == [[0.1, 0.2], [-0.1, 0.3], [-0.1, 0.4]]
    assert samples.integers("placement", missing=0).tolist() == [1, 0, 7]
    assert samples.integers("repeat", missing=-1).tolist() == [-1, -1, -1]
    spots, encoders = samples.spots(), samples.encoders()
    assert spots is not None
    assert encoders is not None
    assert spots[0].tolist() == [1e-3, 2e-3, 3e-3, 4e-3]
    assert np.isnan(spots[1]).all()
    assert np.isnan(encoders[0, 1])
    assert samples.commanded() is None
    assert samples.columns["bar_end"].tolist() == ["", "a", ""]
    assert "temp_room_degC" in samples
    assert list(samples.rows())[1]["bar"] == 3


def test_rows_can_be_taken_by_mask_and_by_index(parse: Callable[[str], Samples]) -> None:
    samples = parse(CSV)
    assert samples.take(samples.column("t_s") > 1.0).column("t_s").tolist() == [1.5, 2.5]
    assert samples.take(np.array([2, 0])).column("t_s").tolist() == [2.5, 0.0]


def test_an_arm_with_another_number_of_joints_cannot_be_asked_for(parse: Callable[[str], Samples]) -> None:
    with pytest.raises(ValueError, match="arm of 2 joints read as 6"):
        parse(CSV).joints(6)


def test_a_column_that_is_not_there_is_reported_with_those_that_are(parse: Callable[[str], Samples]) -> None:
    with pytest.raises(SamplesError, match="no numeric column 'wire_m' in the samples; there are t_s, q1_rad"):
        parse(CSV).column("wire_m")


def test_marks_of_spreadsheets_do_no_harm(parse: Callable[[str], Samples], rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "samples.csv"
    path.write_bytes(b"\xef\xbb\xbft_s, q1_rad ,q2_rad\r\n0.5, 1 ,2\r\n\r\n")
    assert read_csv(path, rig).joints().tolist() == [[1.0, 2.0]]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("1.5,-0.1", "1.5,zero", "s/samples.csv row 2 (line 3), column 'q1_rad': 'zero' is not a number"),
        ("1.5,-0.1", "1.5,1_0", "row 2 (line 3), column 'q1_rad': '1_0' is not a number"),
        ("1.5,-0.1", "1.5,", "row 2 (line 3), column 'q1_rad': the value is missing (empty or NaN)"),
        ("1.5,-0.1", "1.5,nan", "row 2 (line 3), column 'q1_rad': the value is missing (empty or NaN)"),
        ("1.5,-0.1", "1.5,inf", "row 2 (line 3), column 'q1_rad': inf is not a finite number"),
        ("2.5,-0.1,0.4,7", "2.5,-0.1,0.4,8", "column 'placement': 8 is not a [[placement]] of the rig (known: 1, 7)"),
        ("2.5,-0.1,0.4,7", "2.5,-0.1,0.4,7.5", "row 3 (line 4), column 'placement': 7.5 is not a whole number"),
        ("2.5,-0.1,0.4,7", "2.5,-0.1,0.4,", "column 'placement': the value is missing, though the row has spots"),
        ("7,1,0,0,0,0", "7,3,0,0,0,0", "row 3 (line 4), column 'first_psd': 3 is not a detector (known: 1, 2)"),
        ("7,1,0,0,0,0", "7,1,0,0,,0", "column 'psd2_x_m': the value is missing (empty or NaN), though others"),
        (",3,a,", ",4,a,", "row 2 (line 3), column 'bar': 4 is not a [[bar]] of the rig (known: 3)"),
        (",3,a,", ",3,c,", "row 2 (line 3), column 'bar_end': 'c' is no end of a bar"),
        (",3,a,", ",3,,", "row 2 (line 3), column 'bar_end': the value is missing"),
        (",3,a,", ",,a,", "row 2 (line 3), column 'bar': the value is missing"),
        ("1.5,-0.1", "1.5,-0,1", "row 2 (line 3): 15 cells under 14 columns; give every column a cell"),
        ("q2_rad", "q1_rad", "column 'q1_rad' stands twice"),
        ("q2_rad", "=cmd|calc", "column '=cmd|calc' would be a formula"),
        ("q2_rad", "q2_deg", "column 'q2_rad': the column is missing; the rig's arm has 2 joints; is it 'q2_deg'?"),
        ("enc2_rad", "enc3_rad", "column 'enc3_rad': there is no joint 3: the rig's arm has 2 joints"),
        ("temp_room_degC", "q3_rad", "column 'q3_rad': there is no joint 3: the rig's arm has 2 joints"),
        ("enc2_rad", "spare", "column 'enc2_rad': the column is missing, though 'enc1_rad' is there"),
        ("psd2_y_m", "psd2_z_m", "column 'psd2_y_m': the column is missing, though 'psd1_x_m' is there"),
        ("first_psd", "first", "column 'first_psd': the column is missing"),
        ("temp_room_degC", "approach1", "row 1 (line 2), column 'approach1': 20.5 is not a whole number"),
        ("temp_room_degC", "", "column 14 has no name"),
        ("t_s,", "time,", "column 't_s': the column is missing"),
    ],
)  # fmt: skip
def test_bad_input_is_reported_with_row_and_column(
    parse: Callable[[str], Samples], old: str, new: str, says: str
) -> None:
    assert old in CSV
    with pytest.raises(SamplesError) as refused:
        parse(CSV.replace(old, new, 1))
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the file is empty"),
        ("t_s;q1_rad;q2_rad\n0;1;2\n", "line 1: columns are not separated by commas"),
        ('t_s,q1_rad,q2_rad\n0,"1,2\n', "not CSV"),
    ],
)
def test_what_is_no_table_is_refused(parse: Callable[[str], Samples], text: str, says: str) -> None:
    with pytest.raises(SamplesError, match=says):
        parse(text)


def test_the_first_bad_row_is_the_one_that_is_reported(parse: Callable[[str], Samples]) -> None:
    with pytest.raises(SamplesError, match=r"row 1 \(line 2\), column 'placement'"):
        parse(CSV.replace("0.1,0.2,1,2", "0.1,0.2,9,2").replace("2.5,-0.1", "2.5,"))


FINITE = st.floats(-1e3, 1e3, allow_nan=False, width=64)  # within the bounds of all columns
NAMES = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=8).map(
    lambda name: f"my {name}".strip()
)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_every_table_comes_back_bit_for_bit(
    rig: Rig, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    n = data.draw(st.integers(0, 5))
    needed = st.lists(FINITE, min_size=n, max_size=n)
    optional = st.lists(st.none() | FINITE, min_size=n, max_size=n)
    columns: dict[str, list[Any]] = {name: data.draw(needed) for name in ("t_s", "q1_rad", "q2_rad")}
    columns |= {name: data.draw(optional) for name in ("cmd1_rad", "cmd2_rad", "wire_m", *data.draw(st.sets(NAMES)))}
    columns["repeat"] = data.draw(st.lists(st.none() | st.integers(-(2**53) + 1, 2**53 - 1), min_size=n, max_size=n))
    before = checked_samples(columns, rig, lambda row: f"row {row}")
    path = tmp_path_factory.mktemp("round") / "samples.csv"
    write_csv(before, path)
    after = read_csv(path, rig)
    assert after.names == before.names
    for name in before.names:
        np.testing.assert_array_equal(after.columns[name], before.columns[name])
        assert np.array_equal(np.signbit(after.columns[name]), np.signbit(before.columns[name])) or name == "repeat"


@pytest.mark.parametrize("name", ["ur5-tracker", "ur10-leica-a"])
def test_real_tables_come_back_bit_for_bit(root: Path, tmp_path: Path, name: str) -> None:
    folder = root.parent / "shared" / "data" / name
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this checkout (../shared/data)")
    rig = load_rig(folder / "rig.toml")
    before = read_csv(folder / "samples.csv", rig)
    write_csv(before, tmp_path / "samples.csv")
    after = read_csv(tmp_path / "samples.csv", rig)
    assert len(before) > 900
    assert all(np.array_equal(after.columns[column], before.columns[column], equal_nan=True) for column in before.names)


def test_parquet_gives_the_same_table(rig: Rig, tmp_path: Path) -> None:
    columns = {"t_s": [0, 1], "q1_rad": [0.5, 0.25], "q2_rad": [0.0, 1.0], "bar": [None, 3], "bar_end": [None, "a"]}
    pq.write_table(pa.table(columns), tmp_path / "samples.parquet")
    samples = read_parquet(tmp_path / "samples.parquet", rig)
    assert samples.joints().tolist() == [[0.5, 0.0], [0.25, 1.0]]
    assert math.isnan(samples.column("bar")[0])


def test_without_pyarrow_a_parquet_file_is_refused_with_a_remedy(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(SamplesError, match=r"samples.parquet: reading Parquet needs pyarrow; pip install pyarrow"):
        read_parquet(Path("samples.parquet"), rig)
