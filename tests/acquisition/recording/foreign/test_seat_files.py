"""One table a seat: joined in the order given, each row with its seat, errors with the file."""

import numpy as np
import pytest

from acquisition.recording.errors import SamplesError
from acquisition.recording.foreign import columns_file, read_seats, samples_of, understand

JOINTS = 6


@pytest.fixture
def folder(tmp_path):
    """Three files without headings in two folders, and the rows of each."""
    rng = np.random.default_rng(4)
    tables = {}
    for name, rows in (("left/hole_0", 4), ("left/hole_1", 1), ("right/hole_0", 3)):
        path = tmp_path / "places" / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        tables[path] = rng.uniform(-2.0, 2.0, (rows, JOINTS))
        np.savetxt(path, tables[path], fmt="%.17g", delimiter=",")
    return tables


def understood(paths, rig_source):
    return understand(read_seats(list(paths), None, 0), rig_source, "rig.toml", "1..6 [rad] = q")


def test_every_row_has_the_seat_of_its_file(folder, rig_source):
    table = understood(folder, rig_source)
    samples = samples_of(table)
    np.testing.assert_array_equal(samples.joints(), np.concatenate(list(folder.values())))
    np.testing.assert_array_equal(samples.integers("seat", 0), [1, 1, 1, 1, 2, 3, 3, 3])
    notes = columns_file(table, samples, "test").notes
    assert notes[:3] == ("seat 1: left/hole_0, 4 rows", "seat 2: left/hole_1, 1 row", "seat 3: right/hole_0, 3 rows")


def test_a_folder_means_its_tables_by_name(folder, rig_source, tmp_path):
    named = samples_of(understood(folder, rig_source)).columns
    found = samples_of(understood([tmp_path / "places"], rig_source)).columns
    for name, values in named.items():
        np.testing.assert_array_equal(found[name], values)


def test_the_order_given_is_the_order_of_the_seats(folder, rig_source):
    samples = samples_of(understood(reversed(folder), rig_source))
    np.testing.assert_array_equal(samples.integers("seat", 0), [1, 1, 1, 2, 3, 3, 3, 3])


def test_an_error_names_the_file_of_the_row(folder, rig_source):
    path = list(folder)[2]
    path.write_text("1,2,3,4,5,6\n1,2,3,x,5,6\n", encoding="utf-8")
    with pytest.raises(SamplesError, match=r"right/hole_0.csv row 2, column '4': 'x' is not a number"):
        understood(folder, rig_source)


def test_tables_of_another_form_are_refused(folder, rig_source):
    path = list(folder)[1]
    path.write_text("1,2,3,4,5,6,7\n", encoding="utf-8")
    with pytest.raises(SamplesError, match=r"left/hole_1.csv: its headings"):
        understood(folder, rig_source)


def test_one_file_or_one_twice_is_refused(folder, rig_source):
    first, second, _ = folder
    with pytest.raises(SamplesError, match="give one for each seat"):
        understood([first], rig_source)
    with pytest.raises(SamplesError, match="given twice"):
        understood([first, second, first], rig_source)


def test_a_table_that_names_its_seats_needs_no_files_for_them(folder, rig_source):
    for path in folder:
        path.write_text("A1,A2,A3,A4,A5,A6,Seat\n1,2,3,4,5,6,1\n", encoding="utf-8")
    with pytest.raises(SamplesError, match="names the seats already"):
        read_seats(list(folder))
