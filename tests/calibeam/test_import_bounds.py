"""Times and values that cannot be are refused at every door, with file, row, column, value and remedy."""

from pathlib import Path

import can
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from acquisition.recording import read
from calibeam.cli import run

ROOT = Path(__file__).parents[2]
RIG = ROOT / "docs" / "examples" / "lab" / "rig.toml"
ROWS = 300
BAD_TIMES_S = (1e12, -1e10, 1e17, 8e8)  # the last is 25 years after the others


def joints() -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.5, 1.5, (ROWS, 6))


def refused(capsys: pytest.CaptureFixture[str], out: Path, *args: object) -> str:
    assert run(["import", *map(str, args), "--rig", str(RIG), "--out", str(out), "--yes"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "please report" not in said
    assert not out.exists()
    return said


def table(folder: Path, kind: str, columns: dict[str, np.ndarray]) -> Path:
    path = folder / f"log.{kind}"
    if kind == "parquet":
        pq.write_table(pa.table(columns), path)
        return path
    rows = zip(*columns.values(), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(repr(float(cell)) for cell in row) for row in rows)]))
    return path


def columns(times_s: np.ndarray, q_rad: np.ndarray) -> dict[str, np.ndarray]:
    return {"time [s]": times_s} | {f"q{joint} [rad]": q_rad[:, joint - 1] for joint in range(1, 7)}


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("bad_s", BAD_TIMES_S)
def test_one_time_that_cannot_be_is_named_in_a_log(
    kind: str, bad_s: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times_s = 0.01 * np.arange(ROWS)
    times_s[200] = bad_s
    path = table(tmp_path, kind, columns(times_s, joints()))
    said = refused(capsys, tmp_path / "log.mcap", path, "--streams")
    row = 202 if kind == "csv" else 201
    assert f"{path.name} row {row}, column 'time [s]': {bad_s:.12g} s" in said
    assert "correct it, or remove the row" in said


def test_one_time_that_cannot_be_is_named_in_a_table_of_poses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for bad_s in BAD_TIMES_S:
        times_s = 10.0 * np.arange(ROWS)
        times_s[200] = bad_s
        cells = columns(times_s, joints()) | {f"{axis} [m]": joints()[:, 0] for axis in "xyz"}
        said = refused(capsys, tmp_path / "session", table(tmp_path, "csv", cells))
        assert "log.csv row 202" in said
        assert f"column 'time [s]': {bad_s:.12g} s" in said


@pytest.mark.parametrize("bad_rad", [1e282, 2e5, -1e9])
def test_an_angle_that_cannot_be_is_named_also_where_the_unit_is_stated(
    bad_rad: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    q_rad = joints()
    q_rad[100, 2] = bad_rad
    path = table(tmp_path, "csv", columns(0.01 * np.arange(ROWS), q_rad))
    said = refused(capsys, tmp_path / "log.mcap", path, "--streams", "--columns", "q1..q6 [rad] = q")
    assert "log.csv row 102, column 'q3 [rad]'" in said
    assert f"{bad_rad:g}" in said
    assert "beyond 100000" in said


def test_times_since_1970_and_before_a_trigger_are_taken(tmp_path: Path) -> None:
    for begin_s in (1_769_860_800.0, -0.5, 0.0):
        path = table(tmp_path, "csv", columns(begin_s + 0.01 * np.arange(ROWS), joints()))
        out = tmp_path / f"{begin_s:.0f}.mcap"
        assert run(["import", str(path), "--streams", "--rig", str(RIG), "--out", str(out), "--yes"]) == 0
        assert len(read(out).streams["log"].host_s) == ROWS


@pytest.mark.parametrize(
    ("row", "column", "value", "says"),
    [
        (200, "host_s", 1e12, "row 201, column 'host_s': 1e+12 s"),
        (200, "host_s", 8e8, "row 201, column 'host_s': 800000000 s"),
        (100, "position_rad_3", 1e282, "row 101, column 'position_rad_3': 1e+282"),
        (100, "position_rad_3", np.inf, "row 101, column 'position_rad_3': inf"),
    ],
)
def test_one_cell_that_cannot_be_is_named_in_a_session_folder(
    row: int, column: str, value: float, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "session"
    (folder / "streams").mkdir(parents=True)
    (folder / "rig.toml").write_text(RIG.read_text())
    names = ",".join(f"q{joint}_rad" for joint in range(1, 7))
    (folder / "samples.csv").write_text(f"t_s,{names}\n0,0,0,0,0,0,0\n")
    cells = {"host_s": 0.01 * np.arange(ROWS)} | {f"position_rad_{j}": joints()[:, j - 1] for j in range(1, 7)}
    cells[column][row] = value
    table(folder / "streams", "csv", cells)
    assert run(["import", str(folder), "--out", str(tmp_path / "session.mcap")]) == 1
    assert says in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "session.mcap").exists()


def test_a_can_log_is_kept_up_to_a_time_far_from_its_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bus.log"
    with can.Logger(path) as log:
        for number in range(ROWS):
            stamp_s = 1_700_000_000 + 0.01 * number + (8e8 if number == 200 else 0.0)
            log.on_message_received(can.Message(stamp_s, 5, is_extended_id=False, data=[1], channel=0))
    assert run(["import", str(path), "--rig", str(RIG), "--out", str(tmp_path / "bus.mcap")]) != 0
    said = " ".join(capsys.readouterr().err.split())
    assert "after 200 frames" in said
    assert "time stamp 2500000002" in said
