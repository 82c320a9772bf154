"""A law over the registered examinations of `import`: what cannot be examined is never taken for "nothing found"."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from acquisition.recording.examination import FOUND, NOT_EXAMINED, NOTHING
from acquisition.recording.foreign.import_examinations import IMPORT_EXAMINATIONS
from calibeam.cli import run

RIG = Path(__file__).parents[2] / "docs" / "examples" / "lab" / "rig.toml"
ROWS = 8
RNG = np.random.default_rng(11)
Q = tuple(f"q{k} [rad]" for k in range(1, 7))
XYZ = tuple(f"{axis} [m]" for axis in "xyz")
TIME = ("time [s]",)
WHOLE = {
    **{name: RNG.uniform(-1.5, 1.5, ROWS) for name in Q},
    **{name: RNG.uniform(0.5, 1.5, ROWS) for name in XYZ},
    "time [s]": 0.01 * np.arange(ROWS),
}
KINDS, VARIANTS = ("table", "log"), ("absent", "short", "constant", "invalid")
# the columns of each examination; in a log the angles of the joints are readings, too
COLUMNS = {
    ("joint angles", "table"): Q,
    ("joint angles", "log"): Q,
    ("measurements", "table"): XYZ,
    ("measurements", "log"): (*Q, *XYZ),
    ("times", "table"): TIME,
    ("times", "log"): TIME,
}
REFUSED = {  # without these nothing can be made, and the command ends with an error
    ("joint angles", "absent", "table"),
    ("joint angles", "invalid", "table"),
    ("measurements", "absent", "table"),
    ("measurements", "absent", "log"),
    ("times", "absent", "log"),
    ("times", "invalid", "table"),
    ("times", "invalid", "log"),
}
EXAMINATIONS = [examination for examination, _ in IMPORT_EXAMINATIONS]


def spoilt(variant: str, columns: tuple[str, ...]) -> dict[str, Any]:
    """The whole table without these columns, of one row, or with one value or none in them."""
    if variant == "absent":
        return {name: values for name, values in WHOLE.items() if name not in columns}
    if variant == "short":
        return {name: values[:1] for name, values in WHOLE.items()}
    value = np.nan if variant == "invalid" else None
    return {
        name: np.full(ROWS, values[0] if value is None else value) if name in columns else values
        for name, values in WHOLE.items()
    }


def imported(folder: Path, columns: dict[str, Any], kind: str) -> tuple[int, Path]:
    pq.write_table(pa.table(columns), folder / "lab.parquet")
    out = folder / ("out.mcap" if kind == "log" else "out")
    whole = (("q1..q6 [rad] = q", Q), ("x y z [m] = position", XYZ))  # constant values need a person's word for a unit
    stated = ", ".join(text for text, names in whole if set(names) <= set(columns))
    more = ["--columns", stated, *(["--streams"] if kind == "log" else [])]
    command = ["import", str(folder / "lab.parquet"), "--rig", str(RIG), "--out", str(out), "--yes", *more]
    return run(command), out


def records_of(out: Path, what: str) -> list[dict[str, Any]]:
    content = json.loads(out.with_name(f"{out.name}.columns.json").read_text(encoding="utf-8"))
    return [one for one in content["examinations"] if one["what"] == what]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("examination", [e for e in EXAMINATIONS if e.needs], ids=lambda one: one.what)
def test_what_cannot_be_examined_is_not_examined(
    examination: Any, variant: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out = imported(tmp_path, spoilt(variant, COLUMNS[examination.what, kind]), kind)
    said = capsys.readouterr()
    if (examination.what, variant, kind) in REFUSED:
        assert code == 1
        assert said.err.count("error:") == 1
        assert not out.exists()
        return
    assert code == 0, said.err
    records = records_of(out, examination.what)
    assert records
    for record in records:
        assert record["outcome"] == NOT_EXAMINED
        assert record["reason"]
        assert record["remedy"]
    assert f"not examined: {examination.what}" in " ".join(said.out.split())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("examination", [e for e in EXAMINATIONS if not e.needs], ids=lambda one: one.what)
def test_the_content_is_examined_whatever_it_is(examination: Any, variant: str, kind: str, tmp_path: Path) -> None:
    rows = 1 if variant == "short" else ROWS
    remarks = {} if variant == "absent" else {"remark": [None if variant == "invalid" else "good"] * rows}
    code, out = imported(tmp_path, {name: values[:rows] for name, values in WHOLE.items()} | remarks, kind)
    assert code == 0
    (record,) = records_of(out, examination.what)
    if variant == "absent":
        assert record["outcome"] == NOTHING
        assert record["limit"] == 1.0
    else:
        assert record["outcome"] == FOUND
        assert f"column remark ({'empty), 0 row' if variant == 'invalid' else 'text)'}" in record["says"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_whole_table_is_examined_in_everything(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out = imported(tmp_path, WHOLE, kind)
    assert code == 0
    assert "not examined" not in capsys.readouterr().out
    for examination in EXAMINATIONS:
        for record in records_of(out, examination.what):
            assert record["outcome"] == NOTHING
            assert record["limit"] == 1.0


@pytest.mark.parametrize(
    ("change", "kind", "what", "says"),
    [
        ({"x [m]": [np.nan, *WHOLE["x [m]"][1:]]}, "log", "measurements", "1 of 24 readings are missing"),
        ({"q2 [rad]": [np.nan, *WHOLE["q2 [rad]"][1:]]}, "log", "joint angles", "1 of 48 angles are missing"),
        ({"time [s]": [0.0, 2.0, 1.0, *range(3, 8)]}, "log", "times", "1 step back in time, first at row 3"),
        ({"time [s]": [0.0, 1.0, 1.0, *range(3, 8)]}, "log", "times", "1 row with the time of the row before"),
    ],
)
def test_faults_are_found_and_printed(
    change: dict[str, Any], kind: str, what: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out = imported(tmp_path, WHOLE | change, kind)
    assert code == 0
    assert [one["says"] for one in records_of(out, what) if one["outcome"] == FOUND] == [says]
    assert says in " ".join(capsys.readouterr().out.split())


def test_a_table_without_a_quantity_that_another_log_has_is_no_gap(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, columns in (("robot", (*Q, *TIME)), ("tracker", (*XYZ, *TIME))):
        pq.write_table(pa.table({column: WHOLE[column] for column in columns}), tmp_path / f"{name}.parquet")
    sources = [str(tmp_path / f"{name}.parquet") for name in ("robot", "tracker")]
    out = tmp_path / "log.mcap"
    assert run(["import", *sources, "--streams", "--rig", str(RIG), "--out", str(out), "--yes"]) == 0
    assert "not examined" not in capsys.readouterr().out
    robot, tracker = json.loads(out.with_name("log.mcap.columns.json").read_text(encoding="utf-8"))
    assert [one["where"] for one in robot["examinations"] if one["what"] == "joint angles"] == ["robot.parquet"]
    assert [one["what"] for one in tracker["examinations"]] == ["content of the file", "measurements", "times"]
