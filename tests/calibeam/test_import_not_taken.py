"""What a table or a log holds and `import` does not take is named, and nothing understood is an error."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from acquisition.recording import read
from calibeam.cli import run

RIG = Path(__file__).parents[2] / "docs" / "examples" / "lab" / "rig.toml"
ROWS = 8
RNG = np.random.default_rng(7)
JOINTS = {f"q{k} [rad]": RNG.uniform(-1.5, 1.5, ROWS) for k in range(1, 7)}
PLACE = {f"{axis} [m]": RNG.uniform(0.5, 1.5, ROWS) for axis in "xyz"}
TIME = {"time [s]": 0.01 * np.arange(ROWS)}


def import_table(folder: Path, columns: dict[str, object], *more: str, log: bool = False) -> int:
    """Of a Parquet table; `log`: each row is a moment."""
    pq.write_table(pa.table(columns), folder / "lab.parquet")
    out = folder / ("out.mcap" if log else "out")
    command = ["import", str(folder / "lab.parquet"), "--rig", str(RIG), "--out", str(out), "--yes", *more]
    return run([*command, "--streams"] if log else command)


def not_taken(folder: Path, log: bool = False) -> list[dict[str, object]]:
    name = "out.mcap.columns.json" if log else "out.columns.json"
    return json.loads((folder / name).read_text(encoding="utf-8"))["not_taken"]


@pytest.mark.parametrize("log", [False, True], ids=["table", "log"])
def test_columns_that_are_not_taken_are_named_with_type_and_rows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], log: bool
) -> None:
    remarks = ["good", None, "good", *[None] * (ROWS - 3)]
    records = [{"a": 1.0, "b": 2.0}] * ROWS
    assert import_table(tmp_path, TIME | JOINTS | PLACE | {"remark": remarks, "pose": records}, log=log) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"not used: remark (text), 2 rows; pose (records), {ROWS} rows" in said
    assert not_taken(tmp_path, log) == [
        {"kind": "column", "name": "remark", "type": "text", "count": 2},
        {"kind": "column", "name": "pose", "type": "records", "count": ROWS},
    ]


def test_a_column_of_numbers_can_be_kept_by_the_remedy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = JOINTS | PLACE | {"remark": ["x"] * ROWS, "Load": np.arange(float(ROWS))}
    assert import_table(tmp_path, table) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"Load (numbers), {ROWS} rows (keep one with --columns \"'Load' = its_name\")" in said
    (tmp_path / "again").mkdir()
    assert import_table(tmp_path / "again", table, "--columns", "'Load' = its_name") == 0
    np.testing.assert_array_equal(read(tmp_path / "again" / "out").samples.column("its_name"), table["Load"])


def test_lists_of_a_log_are_joints_and_positions(tmp_path: Path) -> None:
    q, xyz = np.column_stack(list(JOINTS.values())), np.column_stack(list(PLACE.values()))
    lists = {"q [rad]": pa.array(q.tolist()), "position [m]": pa.array(xyz.tolist())}
    assert import_table(tmp_path, TIME | lists, log=True) == 0
    (stream,) = read(tmp_path / "out.mcap").streams.values()
    np.testing.assert_allclose(stream.values["actual_q_rad"], q)
    np.testing.assert_allclose(stream.values["position_m"], xyz)


def test_cells_without_a_heading_are_named(tmp_path: Path) -> None:
    lines = [",".join([*JOINTS, "", *PLACE])]
    values = np.column_stack([*JOINTS.values(), np.arange(float(ROWS)), *PLACE.values()])
    lines += [",".join(map(repr, row)) for row in values.tolist()]
    (tmp_path / "lab.csv").write_text("\n".join(lines), encoding="utf-8")
    command = ["import", str(tmp_path / "lab.csv"), "--rig", str(RIG), "--out", str(tmp_path / "out"), "--yes"]
    assert run(command) == 0
    assert not_taken(tmp_path) == [{"kind": "column", "name": "7 without a heading", "type": "numbers", "count": ROWS}]


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({"east": PLACE["x [m]"], "north": PLACE["y [m]"]}, "no columns are understood as the 6 joint angles"),
        (PLACE, "no columns are understood as the 6 joint angles"),
        (JOINTS, "no column is understood as a measurement"),
        (JOINTS | TIME, "no column is understood as a measurement"),
        (JOINTS | {"temp_arm [degC]": np.linspace(20.0, 30.0, ROWS)}, "no column is understood as a measurement"),
        (JOINTS | {"payload [kg]": np.ones(ROWS)}, "no column is understood as a measurement"),
        (JOINTS | {"east": PLACE["x [m]"]}, "no column is understood as a measurement"),
    ],
    ids=["neither", "no joints", "joints", "joints and time", "temperature", "payload", "unknown readings"],
)
def test_a_table_of_poses_that_the_rig_cannot_use_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], columns: dict[str, object], says: str
) -> None:
    assert import_table(tmp_path, columns) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert says in said
    assert f"'{next(iter(columns))}'" in said
    assert "--columns" in said
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "out.columns.json").exists()


@pytest.mark.parametrize(
    "columns",
    [{"east": PLACE["x [m]"], "Load [N]": PLACE["y [m]"]}, {"note": ["calm"] * ROWS}, {"payload [kg]": np.ones(ROWS)}],
    ids=["numbers", "texts", "payload"],
)
def test_a_log_of_which_nothing_is_understood_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], columns: dict[str, object]
) -> None:
    assert import_table(tmp_path, TIME | columns, log=True) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "no joint angles, commands, encoders or measurement are understood" in said
    assert f"in {ROWS} rows there are {', '.join(columns)}" in said
    assert '--columns "A1..A6 [deg] = q"' in said
    assert not (tmp_path / "out.mcap").exists()


@pytest.mark.parametrize(
    ("columns", "stated"),
    [
        ({"Load [N]": PLACE["y [m]"]}, "'Load [N]' = load"),
        ({f"cmd{k} [rad]": JOINTS[f"q{k} [rad]"] for k in range(1, 7)}, ""),
        ({f"enc{k} [rad]": JOINTS[f"q{k} [rad]"] for k in range(1, 7)}, ""),
        (PLACE, ""),
        ({"wire [m]": PLACE["x [m]"]}, ""),
        ({"temp_arm [degC]": np.linspace(20.0, 30.0, ROWS)}, ""),
    ],
    ids=["named by a person", "commands", "encoders", "positions", "wire", "temperature"],
)
def test_a_log_of_one_known_quantity_is_taken(tmp_path: Path, columns: dict[str, object], stated: str) -> None:
    assert import_table(tmp_path, TIME | columns, "--columns", stated, log=True) == 0
    (stream,) = read(tmp_path / "out.mcap").streams.values()
    assert len(stream.host_s) == ROWS


@pytest.mark.parametrize(
    ("columns", "stated"),
    [
        ({"seat": [1, 1, 2, 2, 3, 3, 4, 4]}, ""),
        ({"plane": [1, 1, 2, 2, 3, 3, 4, 4]}, ""),
        ({"dial [mm]": np.linspace(0.0, 1.0, ROWS)}, "'dial [mm]' = dial_m"),
    ],
    ids=["seats", "planes", "own column by name"],
)
def test_tables_of_seats_planes_and_own_columns_are_taken(
    tmp_path: Path, columns: dict[str, object], stated: str
) -> None:
    assert import_table(tmp_path, JOINTS | columns, "--columns", stated) == 0
    assert len(read(tmp_path / "out").samples) == ROWS
