"""Columns of a Parquet file whose cells are lists: each element is a column, or the list is named as not taken."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from acquisition.recording import SamplesError
from acquisition.recording.foreign import columns_file, questions, read_sheet, samples_of, understand
from acquisition.recording.foreign.parquet_sheet import ELEMENTS
from tests.acquisition.recording.foreign.conftest import JOINTS, session


def write(path: Path, columns: dict[str, Any]) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


def as_lists(values: np.ndarray) -> pa.Array:
    return pa.array(values.tolist())


@pytest.mark.parametrize("of_one_size", [False, True], ids=["list", "fixed_size_list"])
@pytest.mark.parametrize(
    ("angles", "places"), [("q [rad]", "position [m]"), ("q_rad", "xyz_m"), ("joint_positions [rad]", "tracker (m)")]
)
def test_lists_of_angles_and_of_coordinates_are_understood(
    tmp_path: Path, rig_source: str, angles: str, places: str, of_one_size: bool
) -> None:
    given = session()
    q = as_lists(given["q"])
    columns = {
        angles: q.cast(pa.list_(pa.float64(), JOINTS)) if of_one_size else q,
        places: as_lists(given["position"]),
    }
    table = understand(read_sheet(write(tmp_path / "lab.parquet", columns)), rig_source, "rig.toml")
    assert list(questions(table)) == []
    samples = samples_of(table)
    np.testing.assert_allclose(samples.joints(), given["q"])
    np.testing.assert_allclose(np.column_stack([samples.column(f"{axis}_m") for axis in "xyz"]), given["position"])


def test_elements_can_be_stated(tmp_path: Path, rig_source: str) -> None:
    given = session()
    columns = {"state": as_lists(np.degrees(given["q"])), "reading": as_lists(1e3 * given["position"])}
    sheet = read_sheet(write(tmp_path / "lab.parquet", columns))
    stated = "state1..state6 [deg] = q, reading1..reading3 [mm] = position"
    table = understand(sheet, rig_source, "rig.toml", stated)
    samples = samples_of(table)
    np.testing.assert_allclose(samples.joints(), given["q"])
    about = columns_file(table, samples, "test")
    assert "column 'state' holds lists of 6: read as state1 … state6" in about.notes
    again = samples_of(understand(sheet, rig_source, "rig.toml", about.stated))
    np.testing.assert_array_equal(again.joints(), samples.joints())


def test_the_unit_beside_a_list_is_that_of_its_elements(tmp_path: Path, rig_source: str) -> None:
    given = session()
    field = pa.field("q", pa.list_(pa.float64()), metadata={b"unit": b"deg"})
    xyz = [pa.field(f"{axis} [m]", pa.float64()) for axis in "xyz"]
    arrays = [as_lists(np.degrees(given["q"])), *(pa.array(column) for column in given["position"].T)]
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema([field, *xyz])), tmp_path / "lab.parquet")
    table = understand(read_sheet(tmp_path / "lab.parquet"), rig_source, "rig.toml")
    np.testing.assert_allclose(samples_of(table).joints(), given["q"])


def test_a_list_that_is_missing_is_a_row_of_missing_readings(tmp_path: Path, rig_source: str) -> None:
    given = session()
    places = [None if row == 3 else one for row, one in enumerate(given["position"].tolist())]
    columns = {"q [rad]": as_lists(given["q"]), "position [m]": pa.array(places)}
    samples = samples_of(understand(read_sheet(write(tmp_path / "a.parquet", columns)), rig_source, "rig.toml"))
    assert np.flatnonzero(np.isnan(samples.column("x_m"))).tolist() == [3]
    columns["q [rad]"] = pa.array([None if row == 5 else one for row, one in enumerate(given["q"].tolist())])
    with pytest.raises(SamplesError, match=r"row 6, column 'q1 .rad.': the value is missing"):
        understand(read_sheet(write(tmp_path / "b.parquet", columns)), rig_source, "rig.toml")


UNEVEN = [[1.0] * (2 + row % 3) for row in range(12)]


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        (UNEVEN, "column 'scan' holds lists of 2 to 4 values, which do not become columns"),
        ([[0.0] * (ELEMENTS + 1)] * 12, f"holds lists of {ELEMENTS + 1} values, which do not become columns"),
        ([["a", "b"]] * 12, "holds lists of other things than numbers"),
        ([[True, False]] * 12, "holds lists of other things than numbers"),
        ([[[1.0], [2.0]]] * 12, "holds lists of other things than numbers"),
    ],
    ids=["uneven", "long", "texts", "truth values", "lists"],
)
def test_other_lists_are_named_as_not_taken(tmp_path: Path, rig_source: str, cells: list[Any], says: str) -> None:
    given = session()
    columns = {"q [rad]": as_lists(given["q"]), "position [m]": as_lists(given["position"]), "scan": pa.array(cells)}
    table = understand(read_sheet(write(tmp_path / "lab.parquet", columns)), rig_source, "rig.toml")
    about = columns_file(table, samples_of(table), "test")
    assert any(says in note for note in about.notes)
    (left,) = about.not_taken
    assert (left.kind, left.name, left.type, left.count) == ("column", "scan", "lists", 12)


def test_elements_do_not_take_the_names_of_other_columns(tmp_path: Path, rig_source: str) -> None:
    given = session()
    columns: dict[str, Any] = {f"q{k} [rad]": given["q"][:, k - 1] for k in range(1, JOINTS + 1)}
    columns |= {"q [rad]": as_lists(given["q"] + 1.0), "position [m]": as_lists(given["position"])}
    table = understand(read_sheet(write(tmp_path / "lab.parquet", columns)), rig_source, "rig.toml")
    np.testing.assert_allclose(samples_of(table).joints(), given["q"])
    assert "q element 1 [rad]" in table.unused()
