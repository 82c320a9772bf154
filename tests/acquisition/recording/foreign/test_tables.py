"""What laboratories write comes back in SI; what cannot be right is refused with its place and a remedy."""

import json

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from acquisition.recording import SamplesError, read
from acquisition.recording.foreign import (
    columns_file,
    questions,
    read_sheet,
    samples_of,
    understand,
    write_session,
)
from acquisition.recording.foreign.heading_units import split_heading
from tests.acquisition.recording.foreign.conftest import JOINTS, session, write_csv, write_xlsx

DEGREES = {"deg": np.degrees(1.0), "rad": 1.0, "mrad": 1e3, "gon": 200.0 / np.pi, "°": np.degrees(1.0)}
LENGTHS = {"mm": 1e3, "m": 1.0, "µm": 1e6, "cm": 1e2}
NAMES = {"A": "A{}", "J": "J{}", "Joint": "Joint {}", "axis": "axis_{}", "q": "q{}", "RTDE": "actual_q_{}"}
FORMS = ("{} [{}]", "{}/{}", "{} ({})", "{} in {}", "{} {}")
QUIET = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def understood(path, rig_source, columns="", sheet=None):
    return understand(read_sheet(path, sheet), rig_source, "rig.toml", columns)


def imported(path, rig_source, columns="", sheet=None):
    """As `import --yes`: SamplesError where a unit is open."""
    table = understood(path, rig_source, columns, sheet)
    for question in questions(table):
        raise SamplesError(question.refusal)
    return table, samples_of(table)


def table_of(given, angle, length):
    """Columns as a laboratory has them: joints, then x, y, z."""
    rows = np.hstack([given["q"] * DEGREES[angle], given["position"] * LENGTHS[length]])
    return [tuple(map(float, row)) for row in rows]


def close(samples, given):
    np.testing.assert_allclose(samples.joints(), given["q"], rtol=1e-12)
    xyz = np.stack([samples.column(name) for name in ("x_m", "y_m", "z_m")], axis=1)
    np.testing.assert_allclose(xyz, given["position"], rtol=1e-12)


@QUIET
@given(
    seed=st.integers(0, 10**6),
    name=st.sampled_from(sorted(NAMES)),
    form=st.sampled_from(FORMS),
    angle=st.sampled_from(sorted(DEGREES)),
    length=st.sampled_from(sorted(LENGTHS)),
    dialect=st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", ","), ("\t", ".")]),
    bom=st.booleans(),
    encoding=st.sampled_from(["utf-8", "cp1252"]),
    title=st.booleans(),
    unit_row=st.booleans(),
)
def test_any_text_dialect_comes_back(
    tmp_path, rig_source, seed, name, form, angle, length, dialect, bom, encoding, title, unit_row
):
    given = session(seed=seed)
    first = 0 if name == "RTDE" else 1
    names = [NAMES[name].format(i + first) for i in range(JOINTS)] + ["X", "Y", "Z"]
    units = [angle] * JOINTS + [length] * 3
    headings = names if unit_row else [form.format(n, u) for n, u in zip(names, units, strict=True)]
    path = write_csv(
        tmp_path / "lab.csv",
        headings,
        table_of(given, angle, length),
        separator=dialect[0],
        decimal=dialect[1],
        bom=bom and encoding == "utf-8",
        encoding=encoding,
        title=["KR6, Halle 3"] if title else [],
        units=units if unit_row else None,
    )
    close(imported(path, rig_source)[1], given)


@pytest.mark.parametrize("as_text", [False, True])
@pytest.mark.parametrize("unit_row", [False, True])
def test_workbooks_come_back(tmp_path, rig_source, as_text, unit_row):
    given = session(seed=3)
    names = [f"A{i}" for i in range(1, 7)] + ["X", "Y", "Z"]
    units = ["°"] * 6 + ["mm"] * 3
    rows = table_of(given, "deg", "mm")
    if as_text:  # as it is when a German CSV was pasted
        rows = [tuple(repr(v).replace(".", ",") for v in row) for row in rows]
    headings = names if unit_row else [f"{n} [{u}]" for n, u in zip(names, units, strict=True)]
    path = write_xlsx(
        tmp_path / "lab.xlsx", headings, rows, title=["Messung"], units=units if unit_row else None, others=["notes"]
    )
    close(imported(path, rig_source)[1], given)


def test_parquet_with_units_in_its_fields(tmp_path, rig_source):
    given = session(seed=4)
    fields = [pa.field(f"J{i}", pa.float64(), metadata={"unit": "deg"}) for i in range(1, 7)]
    fields += [pa.field(axis, pa.float64(), metadata={"unit": "mm"}) for axis in "xyz"]
    columns = np.array(table_of(given, "deg", "mm")).T
    pq.write_table(pa.table([pa.array(c) for c in columns], schema=pa.schema(fields)), tmp_path / "lab.parquet")
    close(imported(tmp_path / "lab.parquet", rig_source)[1], given)


def rotation_columns(kind, turns, position_mm):
    """Headings, cells and the meaning to state where the headings do not show it."""
    euler = {"abc": ("ZYX", "A B C"), "wpr": ("xyz", "W P R")}
    if kind in euler:
        axes, names = euler[kind]
        return [f"{n} [deg]" for n in names.split()], turns.as_euler(axes, degrees=True), ""
    if kind == "quaternion":
        return ["q1", "q2", "q3", "q4"], np.roll(turns.as_quat(), 1, axis=1), ""
    if kind == "quaternion-xyzw":
        return ["a", "b", "c", "d"], turns.as_quat(), "a b c d = quaternion-xyzw"
    if kind == "rotvec":
        return ["RX [rad]", "RY [rad]", "RZ [rad]"], turns.as_rotvec(), ""
    if kind == "matrix":
        return [f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)], turns.as_matrix().reshape(-1, 9), ""
    pose = np.tile(np.eye(4), (len(position_mm), 1, 1))
    pose[:, :3, :3], pose[:, :3, 3] = turns.as_matrix(), position_mm
    names = [f"m{i}{j}" for i in (1, 2, 3, 4) for j in (1, 2, 3, 4)]
    return [f"{n} [mm]" if n in ("m14", "m24", "m34") else n for n in names], pose.reshape(-1, 16), ""


KINDS = ("abc", "wpr", "quaternion", "quaternion-xyzw", "rotvec", "matrix", "pose-matrix")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_orientations_of_every_make_come_back(tmp_path, rig_source, kind, seed):
    given = session(seed=seed)
    turns = Rotation.random(len(given["q"]), random_state=seed)
    position_mm = 1e3 * given["position"]
    headings, cells, columns = rotation_columns(kind, turns, position_mm)
    joints = [f"J{i} [deg]" for i in range(1, 7)]
    place = [] if kind == "pose-matrix" else ["X [mm]", "Y [mm]", "Z [mm]"]
    parts = [np.degrees(given["q"]), *([] if kind == "pose-matrix" else [position_mm]), cells]
    rows = [tuple(map(float, row)) for row in np.hstack(parts)]
    path = write_csv(tmp_path / "lab.csv", joints + place + headings, rows, separator=";", decimal=",")
    samples = imported(path, rig_source, columns)[1]
    close(samples, given)
    vectors = np.stack([samples.column(name) for name in ("rx_rad", "ry_rad", "rz_rad")], axis=1)
    assert np.max((Rotation.from_rotvec(vectors) * turns.inv()).magnitude()) < 1e-12


def test_columns_of_ones_own_names(tmp_path, rig_source):
    given = session(seed=5)
    headings = [f"Winkel, Achse {i}" for i in range(1, 7)] + ["Ost", "Nord", "Hoch", "Öldruck [bar]", "Bemerkung"]
    rows = [(*row, 12.5, "gut") for row in table_of(given, "deg", "mm")]
    path = write_csv(tmp_path / "lab.csv", headings, rows, separator=";")
    columns = (
        "'Winkel, Achse 1'..'Winkel, Achse 6' [deg] = q, Ost Nord Hoch [mm] = position, 'Öldruck [bar]' = oil_bar, "
        "Bemerkung = unused"
    )
    table, samples = imported(path, rig_source, columns)
    close(samples, given)
    assert set(samples.column("oil_bar")) == {12.5}
    assert table.unused() == ("Bemerkung",)


def test_what_was_understood_reads_the_table_again(tmp_path, rig_source):
    given = session(seed=6)
    headings = [f"A{i} [deg]" for i in range(1, 7)] + ["X/mm", "Y/mm", "Z/mm"]
    path = write_csv(tmp_path / "lab.csv", headings, table_of(given, "deg", "mm"))
    table, samples = imported(path, rig_source)
    columns_path = write_session(table, samples, columns_file(table, samples, "test"), tmp_path / "session")
    about = json.loads(columns_path.read_text())
    assert columns_path == tmp_path / "session.columns.json"
    assert about["columns"][0]["becomes"] == [f"q{i}_rad" for i in range(1, 7)]
    again = imported(path, rig_source, about["stated"])[1]
    close(again, given)
    close(read(tmp_path / "session").samples, given)
    close(read(tmp_path / "session" / "samples.csv").samples, given)


def test_conditions_and_times_are_converted(tmp_path, rig_source):
    given = session(rows=4, seed=7)
    headings = [
        "Time [ms]",
        *(f"q{i}_deg" for i in range(1, 7)),
        "x_mm",
        "y_mm",
        "z_mm",
        "temp_arm [°F]",
        "payload [g]",
    ]
    rows = [(1000.0 * (100.0 + k), *row, 68.0, 500.0) for k, row in enumerate(table_of(given, "deg", "mm"))]
    samples = imported(write_csv(tmp_path / "lab.csv", headings, rows), rig_source)[1]
    np.testing.assert_allclose(samples.column("t_s"), [100.0, 101.0, 102.0, 103.0])
    np.testing.assert_allclose(samples.column("temp_arm_degC"), 20.0, rtol=1e-12)
    np.testing.assert_allclose(samples.column("payload_kg"), 0.5)


@pytest.mark.parametrize(
    "times",
    [
        ["2026-01-31 12:00:00.000", "2026-01-31 12:00:01.500"],
        [1769860800000000000, 1769860801500000000],
    ],
)
def test_times_of_the_calendar_count_from_the_first_row_to_the_last_digit(tmp_path, rig_source, times):
    given = session(rows=2, seed=8)
    heading = "time [ns]" if isinstance(times[0], int) else "time"
    headings = [heading, *(f"J{i} [deg]" for i in range(1, 7)), "X [mm]", "Y [mm]", "Z [mm]"]
    rows = [(t, *row) for t, row in zip(times, table_of(given, "deg", "mm"), strict=True)]
    samples = imported(write_csv(tmp_path / "lab.csv", headings, rows), rig_source)[1]
    assert samples.column("t_s").tolist() == [0.0, 1.5]


HEADINGS = [f"A{i} [deg]" for i in range(1, 7)] + ["X [mm]", "Y [mm]", "Z [mm]"]


def refused(tmp_path, rig_source, headings, rows, columns="", name="lab.csv", **how):
    write = write_xlsx if name.endswith("xlsx") else write_csv
    with pytest.raises(SamplesError) as error:
        imported(write(tmp_path / name, headings, rows, **how), rig_source, columns)
    return str(error.value)


@pytest.mark.parametrize(
    ("names", "stated", "angle", "length", "why", "remedy"),
    [
        ("A{}", "{}", "deg", "mm", "no unit", "[deg] = q"),
        ("A{}", "{} [rad]", "deg", "mm", "in rad the values reach", "[deg] = q"),
        ("A{}", "{} [deg]", "rad", "mm", "in deg the values span", "[rad] = q"),
        ("A{}", "{} [Umdr]", "deg", "mm", "'Umdr' is not known", "= q"),
        ("A{}", "{} [mm]", "deg", "mm", "is no unit of q", "= q"),
    ],
)
def test_open_units_of_joints_are_refused_with_column_and_remedy(
    tmp_path, rig_source, names, stated, angle, length, why, remedy
):
    rows = table_of(session(), angle, length)
    headings = [stated.format(names.format(i)) for i in range(1, 7)] + ["X [mm]", "Y [mm]", "Z [mm]"]
    message = refused(tmp_path, rig_source, headings, rows)
    assert why in message
    assert remedy in message
    assert "'A1" in message
    assert "--columns" in message


@pytest.mark.parametrize(
    ("stated", "length", "why"),
    [("{}", "mm", "no unit"), ("{} [m]", "mm", "in m the values"), ("{} [mm]", "m", "in mm the values span")],
)
def test_open_units_of_positions_are_refused(tmp_path, rig_source, stated, length, why):
    headings = [*HEADINGS[:6], *(stated.format(axis) for axis in "XYZ")]
    message = refused(tmp_path, rig_source, headings, table_of(session(), "deg", length))
    assert why in message
    assert "= position" in message


@pytest.mark.parametrize(
    ("names", "angle"),
    [
        ([f"rax_{i}" for i in range(1, 7)], "deg"),  # jointtarget of RAPID
        ([f"robax{i}" for i in range(1, 7)], "deg"),
        ([f"E6AXIS.A{i}" for i in range(1, 7)], "deg"),
        ([f"$AXIS_ACT.A{i}" for i in range(1, 7)], "deg"),
        ([f"actual_q_{i}" for i in range(6)], "rad"),  # RTDE
        ([f"A{i} [Grad]" for i in range(1, 7)], "deg"),
        ([f"Achse {i} [Grd]" for i in range(1, 7)], "deg"),
    ],
)
def test_names_of_makers_are_known_with_their_units(tmp_path, rig_source, names, angle):
    given = session(rows=20, seed=4)
    path = write_csv(tmp_path / "lab.csv", [*names, "X [mm]", "Y [mm]", "Z [mm]"], table_of(given, angle, "mm"))
    close(imported(path, rig_source)[1], given)


@pytest.mark.parametrize("heading", ["A{} [grad]", "A{} (GRAD)", "A{}/grad", "A{} [grd]", "A{}"])
def test_degrees_and_gon_are_not_confused(tmp_path, rig_source, heading):
    headings, rows = [*(heading.format(i) for i in range(1, 7)), *HEADINGS[6:]], table_of(session(rows=20), "deg", "mm")
    units = None if heading != "A{}" else [*["GRAD"] * 6, *["mm"] * 3]
    message = refused(tmp_path, rig_source, headings, rows, units=units)
    assert "write deg or gon" in message
    assert "[deg|gon] = q" in message
    assert "use deg, gon" in refused(tmp_path, rig_source, HEADINGS, rows, "A1..A6 [grad] = q")


def test_the_unit_of_a_makers_name_is_held_against_the_values(tmp_path, rig_source):
    given = session(rows=20, seed=4)
    headings = [*(f"rax_{i}" for i in range(1, 7)), "X [mm]", "Y [mm]", "Z [mm]"]
    assert "[rad] = q" in refused(tmp_path, rig_source, headings, table_of(given, "rad", "mm"))


@pytest.mark.parametrize("header_row", [None, 4])
def test_titles_of_several_words_are_no_headings(tmp_path, rig_source, header_row):
    given, path = session(rows=5, seed=2), tmp_path / "lab.csv"
    write_csv(path, HEADINGS, table_of(given, "deg", "mm"), separator=";")
    path.write_text("Firma GmbH;;;\nKalibrierung KR 6;12.11.2026;Halle 4;\n;;\n" + path.read_text())
    table = understand(read_sheet(path, header_row=header_row), rig_source, "rig.toml", "")
    close(samples_of(table), given)
    assert "Firma GmbH" in table.sheet.title


def test_a_row_of_headings_that_is_stated_is_taken(tmp_path, rig_source):
    given, path = session(rows=5, seed=2), tmp_path / "lab.csv"
    write_csv(path, HEADINGS, table_of(given, "deg", "mm"))
    path.write_text(",".join(f"column {c}" for c in "abcdefghijk") + "\n" + path.read_text())
    assert "column a" in refused_by(lambda: samples_of(understand(read_sheet(path), rig_source, "rig.toml", "")))
    close(samples_of(understand(read_sheet(path, header_row=2), rig_source, "rig.toml", "")), given)
    assert "--header-row 9" in refused_by(lambda: read_sheet(path, header_row=9))


def test_a_restarted_log_with_headings_again_is_refused_and_no_row_is_lost(tmp_path, rig_source):
    rows, path = table_of(session(rows=30), "deg", "mm"), tmp_path / "lab.csv"
    write_csv(path, HEADINGS, [*rows[:10], [*HEADINGS, "temp_arm [degC]"], *((*row, 20.5) for row in rows[10:])])
    assert "lab.csv: row 1 and row 12 may both be the headings" in (message := refused_by(lambda: read_sheet(path)))
    assert "--header-row 12" in message
    assert len(read_sheet(path, header_row=12).rows) == 20
    write_csv(path, [*HEADINGS, "temp_arm [degC]"], [*((*row, 20.5) for row in rows[:10]), HEADINGS, *rows[10:]])
    assert "row 1 and row 12" in refused_by(lambda: read_sheet(path))


@pytest.mark.parametrize("first_two", [("-", "-"), ("s", "K")])
def test_units_are_no_headings_though_some_columns_have_no_name(tmp_path, rig_source, first_two):
    given = session(rows=5)
    rows = [(k, 20.5, *row) for k, row in enumerate(table_of(given, "deg", "mm"))]
    headings, units = ["no", "", *(f"q{i}" for i in range(1, 7)), "X", "Y", "Z"], [*["deg"] * 6, *["mm"] * 3]
    path = write_csv(tmp_path / "lab.csv", headings, rows, units=[*first_two, *units])
    close(imported(path, rig_source, "no = unused")[1], given)


def test_readings_that_are_not_there_are_no_headings(tmp_path):
    rows = table_of(session(rows=6), "deg", "mm")
    rows.insert(3, (*["nan"] * 9, "lost"))
    sheet = read_sheet(write_csv(tmp_path / "lab.csv", [*HEADINGS, "remark"], rows))
    assert (sheet.heading_line, len(sheet.rows)) == (1, 7)
    path = write_csv(tmp_path / "lab.csv", HEADINGS, rows)
    assert "row 5: more cells than the 9 headings" in refused_by(lambda: read_sheet(path))


def refused_by(call):
    with pytest.raises(SamplesError) as error:
        call()
    return str(error.value)


def test_a_stated_unit_is_trusted(tmp_path, rig_source):
    given = session()
    headings = [f"A{i}" for i in range(1, 7)] + ["X", "Y", "Z"]
    path = write_csv(tmp_path / "lab.csv", headings, table_of(given, "deg", "mm"))
    close(imported(path, rig_source, "A1..A6 [deg] = q, X Y Z [mm] = position")[1], given)


def test_the_proposed_unit_is_the_only_one_that_fits(tmp_path, rig_source):
    headings = [f"A{i} [rad]" for i in range(1, 7)] + ["X", "Y", "Z"]
    table = understood(write_csv(tmp_path / "lab.csv", headings, table_of(session(), "deg", "mm")), rig_source)
    assert [(q.group.meaning, q.proposal) for q in questions(table)] == [("q", "deg"), ("position", "mm")]


def test_faults_name_file_sheet_row_column_value_and_remedy(tmp_path, rig_source):
    rows = [list(row) for row in table_of(session(), "deg", "mm")]
    rows[4][2] = "9O.5"
    message = refused(tmp_path, rig_source, HEADINGS, rows, name="lab.xlsx", title=["Messung vom Montag"])
    assert "lab.xlsx sheet 'Messung' row 7, column 'A3 [deg]': '9O.5' is not a number; correct the cell" in message


@pytest.mark.parametrize(
    ("row", "column", "cell", "says"),
    [
        (2, 1, None, "row 4, column 'A2 [deg]': the value is missing"),
        (3, 7, None, "row 5, column 'Y [mm]': the value is missing, and the others of the row are there"),
        (0, 0, "#REF!", "'#REF!' is not a number; correct the formula"),
        (0, 0, "1.034,221", "without a separator of thousands"),
        (5, 8, "=A1", "row 7, column 'Z [mm]': the formula '=A1' has no stored result"),
    ],
)
def test_cells_that_are_no_readings(tmp_path, rig_source, row, column, cell, says):
    rows = [list(one) for one in table_of(session(), "deg", "mm")]
    rows[row][column] = cell
    assert says in refused(tmp_path, rig_source, HEADINGS, rows, name="lab.xlsx")


def test_decimals_of_two_kinds_are_refused(tmp_path, rig_source):
    rows = [tuple(repr(v).replace(".", ",") for v in row) for row in table_of(session(), "deg", "mm")]
    rows[3] = tuple(cell.replace(",", ".") for cell in rows[3])
    message = refused(tmp_path, rig_source, HEADINGS, rows, separator=";")
    assert "in row 2 has a decimal comma" in message
    assert "in row 5 a decimal point" in message


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ("A1..A6 [deg] = q, X Y [mm] = position", "position takes 3 columns, 2 are given"),
        ("A1..A5 [deg] = q", "q takes 6 columns"),
        ("Q1..Q6 [deg] = q", "has no column 'Q1'; there are A1 [deg]"),
        ("A1..A6 [mm] = q", "'mm' is no unit of q; use deg, rad"),
        ("A1 A2 = speeds", "no meaning of several columns"),
        ("X = x_m", "alone is no column of one's own"),
        ("X Y Z [mm] = position, X = wire", "'X [mm]' stands twice"),
        ("A1..A6 [deg]", "is no `HEADINGS [unit] = meaning`"),
        ("A6..A1 [deg] = q", "is no range"),
    ],
)
def test_statements_that_do_not_fit(tmp_path, rig_source, columns, says):
    assert says in refused(tmp_path, rig_source, HEADINGS, table_of(session(), "deg", "mm"), columns)


@pytest.mark.parametrize(
    ("headings", "says"),
    [
        ([*HEADINGS[:5], "F", *HEADINGS[6:]], "5 joint angles (A1 [deg] … A5 [deg]) for an arm of 6 joints"),
        ([*HEADINGS[:6], "U", "V", "K"], "no column is understood as a measurement"),
        (["U1 [deg]", *HEADINGS[1:]], "no columns are understood as the 6 joint angles"),
    ],
)
def test_tables_that_lack_something(tmp_path, rig_source, headings, says):
    assert says in refused(tmp_path, rig_source, headings, table_of(session(), "deg", "mm"))


def test_columns_that_may_both_be_meant(tmp_path, rig_source):
    rows = [row + row[:6] for row in table_of(session(), "deg", "mm")]
    message = refused(tmp_path, rig_source, HEADINGS + [f"J{i} [deg]" for i in range(1, 7)], rows)
    assert "q may be" in message
    assert "state which" in message


def test_rotations_that_are_none(tmp_path, rig_source):
    given = session()
    rows = [(*row, 0.9, 0.0, 0.0, 0.0) for row in table_of(given, "deg", "mm")]
    message = refused(tmp_path, rig_source, [*HEADINGS, "qw", "qx", "qy", "qz"], rows)
    assert "row 2, column 'qw': 0.9, 0, 0, 0 as quaternion: its length is not 1" in message


def test_sheets_are_named_where_several_hold_tables(tmp_path, rig_source):
    given = session()
    path = write_xlsx(tmp_path / "lab.xlsx", HEADINGS, table_of(given, "deg", "mm"))
    book = openpyxl.load_workbook(path)
    for row in (HEADINGS, *table_of(session(seed=2), "deg", "mm")):
        (book["two"] if "two" in book.sheetnames else book.create_sheet("two")).append(row)
    book.save(path)
    with pytest.raises(SamplesError, match=r"several sheets hold tables \(Messung, two\); name one with --sheet"):
        read_sheet(path)
    close(imported(path, rig_source, sheet="Messung")[1], given)
    with pytest.raises(SamplesError, match="no sheet 'three'; there are Messung, two"):
        read_sheet(path, "three")


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("q1 [deg]", "q1", "deg"),
        ("q1 deg/s", "q1", "deg/s"),
        ("q1/deg/s", "q1", "deg/s"),
        ("Joint 1 / °", "Joint 1", "°"),
        ("Joint 1 in deg", "Joint 1", "deg"),
        ("x_mm", "x", "mm"),
        ("qd1_rad_s", "qd1", "rad_s"),
        ("bar_end", "bar_end", ""),
        ("A1 (nominal)", "A1 (nominal)", ""),
        ("repeat [-]", "repeat", ""),
        ("p [bar]", "p", "bar"),
        ("µm", "µm", ""),
    ],
)
def test_headings_are_name_and_unit(heading, name, unit):
    assert split_heading(heading) == (name, unit)


@pytest.mark.parametrize("content", [b"", b"\x00\x01", b"PK\x03\x04 no book", b"a;b\n", b"1,2\n3,4\n"])
@pytest.mark.parametrize("name", ["lab.csv", "lab.xlsx", "lab.parquet"])
def test_files_that_hold_no_table(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SamplesError, match="lab"):
        read_sheet(tmp_path / name)


def test_the_unit_of_a_column_without_a_reading_is_not_questioned(tmp_path, rig_source):
    given = session()
    pairs = zip(given["q"].tolist(), given["position"].tolist(), strict=True)
    rows = [(*q, None, None, None, *x) for q, x in pairs]
    headings = [*(f"q{k} [rad]" for k in range(1, JOINTS + 1)), *(f"{a} [m]" for a in ("X", "Y", "Z"))]
    headings += [f"camera {a} [m]" for a in ("x", "y", "z")]
    _, samples = imported(write_csv(tmp_path / "lab.csv", headings, rows), rig_source)
    assert np.isnan(samples.column("x_m")).all()
