"""The D-H table of an arm of poses: what the data determine lies within its sigma of the axes of the emulated arm."""

import csv
import re

import numpy as np
import pytest
from msgspec.structs import replace

from acquisition.recording import read
from calibeam.cli import run
from calibrate.apply.export.nominal_table import cells, nominal_table, to_sigma
from calibrate.model.model_file import read_model, write_model
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.sections.parameter_tables import table_part
from tests.calibrate.apply.export.tracked import tracked

WRONG_M = 3e-4  # of origins; of axes in rad


@pytest.fixture(scope="module", params=["kuka-kr6-r900", "fanuc-lrmate-200id"])
def identified(request, tmp_path_factory):
    """Folder of a session of a wrong arm, its evidence."""
    at = tmp_path_factory.mktemp("dh")
    folder = tracked(at / "session", request.param, lengths_m=WRONG_M)
    assert run(["identify", str(folder), "--out", str(at / "model.json")]) == 0
    return at, session_evidence(read(folder), read_model(at / "model.json"))


def rows_of(evidence):
    return {row.parameter: row for row in nominal_table(evidence.calibrated_arm)}


def between(one, other):
    """Length of the common normal and angle of two axes; of near-parallel ones the distance of the other's point."""
    (p, u), (r, v) = one, other
    normal = np.cross(u, v)
    angle = np.arctan2(np.linalg.norm(normal), u @ v)
    if np.linalg.norm(normal) < 0.01:
        return np.linalg.norm(r - p - ((r - p) @ u) * u), angle
    return abs((r - p) @ normal) / np.linalg.norm(normal), angle


def test_lengths_and_twists_are_those_between_the_axes_of_the_real_arm(identified):
    at, evidence = identified
    axes, rows = np.load(at / "axes.npy"), rows_of(evidence)
    for i in range(5):
        length_m, angle_rad = between(axes[i], axes[i + 1])
        length, twist = rows[f"link{i + 1}.length"], rows[f"link{i + 1}.twist"]
        assert abs(abs(length.calibrated) - 1e3 * length_m) < 4.0 * length.sigma < 0.1
        if i != 1:  # between parallel axes twist and tilt are two parts of one small angle
            assert abs(abs(twist.calibrated) - np.degrees(angle_rad)) < 4.0 * twist.sigma < 0.03
    away = [row for name, row in rows.items() if name.startswith("link") and row.correction is not None]
    assert sum(abs(row.correction) > 4.0 * row.sigma for row in away) > 5  # the nominal arm is another one


def test_the_exported_table_has_the_rows_of_the_report_or_names_the_remedy(identified, tmp_path):
    at = identified[0]
    model, out = read_model(at / "model.json"), tmp_path / "arm.csv"
    assert run(["export-model", str(at / "model.json"), "--to", "table", "--out", str(out)]) == 0
    rows = list(csv.reader(line for line in out.read_text(encoding="utf-8").splitlines() if line[0] != "#"))[1:]
    again = session_evidence(read(at / "session"), replace(model, dh_table=()))  # from the recording alone
    for row, shown in zip(rows, nominal_table(again.calibrated_arm), strict=True):
        numbers = [to_sigma(v, shown.sigma) for v in (shown.correction, shown.sigma, shown.calibrated)]
        assert row == [shown.parameter, shown.unit, repr(shown.nominal), *numbers, shown.why]
        assert all(numbers) != bool(shown.why)
    assert sum(row[-1] == "" for row in rows) >= 15
    write_model(tmp_path / "older.json", replace(model, dh_table=()))
    assert run(["export-model", str(tmp_path / "older.json"), "--to", "table", "--out", str(out), "--force"]) == 0
    assert "for its D-H table identify the recording again" in out.read_text(encoding="utf-8")


def test_a_diagnosed_model_has_the_same_table(identified, tmp_path):
    session, model = identified[0] / "session", tmp_path / "model.json"
    assert run(["diagnose", str(session), "--out", str(tmp_path / "diagnosis.json"), "--model-out", str(model)]) == 0
    rows, same = rows_of(session_evidence(read(session), read_model(model))), rows_of(identified[1])
    assert {name: row.why for name, row in rows.items()} == {name: row.why for name, row in same.items()}
    for name, row in rows.items():
        if row.calibrated is not None:
            assert abs(row.calibrated - same[name].calibrated) < 2.0 * row.sigma < 4.0 * same[name].sigma


def test_what_no_tracker_of_unknown_place_shows_has_a_reason_and_no_number(identified):
    rows = rows_of(identified[1])
    first, last = [name for name in rows if "." not in name][::5]
    without = {name: row.why for name, row in rows.items() if row.correction is None}
    among = {"link1.offset", "link2.offset", "link3.offset", "link6.offset", "link6.length", "link6.twist"}
    assert set(without) == {first, last, *among}
    assert "device" in without[first]
    assert "tool" in without[last]
    assert without["link2.offset"] == "only in combination: link2.offset + link3.offset"


def test_page_and_terminal_show_every_joint_and_number_to_two_digits_of_sigma(
    identified, capsys, tmp_path, monkeypatch
):
    monkeypatch.setenv("COLUMNS", "120")
    at, evidence = identified
    page = "".join(table_part(evidence))
    assert run(["identify", str(at / "session"), "--out", str(tmp_path / "model.json"), "--verbose"]) == 0
    terminal = [re.split(r"\s*[│┃]\s*", line) for line in capsys.readouterr().out.splitlines()]
    for shown in map(cells, rows_of(evidence).values()):
        if len(shown) < 5:
            assert "not determined" in shown[2]
            continue
        assert len(re.sub(r"^[0.]*", "", shown[3]).replace(".", "")) == 2
        assert len({len(number.partition(".")[2]) for number in shown[1:]}) == 1
        assert all(f">{number}" in page for number in shown)
        assert any(list(shown) == line[1:6] for line in terminal)


def test_with_held_lengths_only_zeros_have_numbers(identified, tmp_path):
    folder, out = identified[0] / "session", tmp_path / "zeros.json"
    assert run(["identify", str(folder), "--zeros-only", "--out", str(out)]) == 0
    rows = rows_of(session_evidence(read(folder), read_model(out)))
    known = [name for name, row in rows.items() if row.correction is not None]
    assert [name[1:] for name in known] == ["2", "3", "4", "5"]
    assert {row.why for name, row in rows.items() if name.startswith("link")} == {"held at its nominal value"}
