"""Offsets for a controller from a recording: the hidden ones within their sigma, and the error that remains."""

import csv
import re

import numpy as np
import pytest

from acquisition.recording.rig import parse_rig
from calibeam.cli import run
from calibrate.apply.export.export import export_model, form_named
from calibrate.model.model_file import read_model
from tests.calibrate.apply.export.tracked import HIDDEN_DEG, SIGMA_M, tracked

OPEN = (0, 5)  # a turn of joint 1 is one of the base, of joint 6 one of the target: no tracker shows either


def offsets(path):
    """Rows of a mastering table, and its explanation."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    return list(csv.DictReader(line for line in lines if not line.startswith("#"))), comments


def remaining_um(comments):
    """(calibrated, nominal) of every sentence on the error that remains."""
    found = [re.findall(r"([\d.]+)\s(µm|mm)", line) for line in comments if "remaining error" in line]
    return [tuple(float(v) * (1e3 if unit == "mm" else 1.0) for v, unit in one) for one in found]


def mastered(tmp_path, name, form, **drawn):
    folder, out = tracked(tmp_path / "session", name, **drawn), tmp_path / "zeros.json"
    assert run(["identify", str(folder), "--zeros-only", "--out", str(out), "--export", form]) == 0
    return out, *offsets(tmp_path / f"zeros.{form}.csv")


@pytest.mark.parametrize(
    ("name", "form"),
    [("kuka-kr6-r900", "kuka-mastering"), ("fanuc-lrmate-200id", "fanuc-mastering"), ("abb-irb120", "abb-moc")],
)
def test_the_offsets_of_the_table_are_those_hidden_in_the_readings(tmp_path, name, form):
    out, rows, comments = mastered(tmp_path, name, form)
    for i, (row, hidden) in enumerate(zip(rows, HIDDEN_DEG, strict=True)):
        if i in OPEN:
            assert row["offset_deg"] == row["sigma_deg"] == ""
            assert row["not_entered_because"].startswith("not determined: only in combination")
            continue
        sigma = float(row["sigma_deg"])
        assert abs(float(row["offset_deg"]) - hidden) < 3.0 * sigma < 0.01
        assert len(row["sigma_deg"].lstrip("0.")) == 2
        assert len(row["offset_deg"].partition(".")[2]) == len(row["sigma_deg"].partition(".")[2])
    noise_um = 1e6 * SIGMA_M * np.sqrt(3.0)
    assert len(remaining_um(comments)) == 3  # measured points, and two ways to hold rows out
    for calibrated, nominal in remaining_um(comments):
        assert 0.7 * noise_um < calibrated < 1.6 * noise_um
        assert nominal > 300.0
    assert not [name for name, value in read_model(out).chain.items() if name.startswith("link") and value != 0.0]


def test_motor_angles_without_a_gear_ratio_are_empty_and_the_remedy_is_named(tmp_path, capsys):
    """The same offsets with ratios of this test's own: motor angle = ratio times angle of the axis."""
    out, rows, comments = mastered(tmp_path, "abb-irb120", "abb-moc")
    assert {row["motor_rad"] for row in rows} == {""}
    assert {row["not_entered_because"] for row in rows[1:5]} == {"no gear_ratio in the rig file"}
    for text in (" ".join(capsys.readouterr().out.split()), "\n".join(comments)):
        assert "motor_rad is empty for axes 1, 2, 3, 4, 5, 6: rig abb-irb120 has no gear_ratio for them" in text
    known = read_model(out)
    geared = known.rig.text.replace("[[arm.joint]]", "[[arm.joint]]\ngear_ratio = 80.0", 3)
    export_model(tmp_path / "geared.csv", parse_rig(geared, "rig.toml"), known, form_named("abb-moc"))
    rows, comments = offsets(tmp_path / "geared.csv")
    assert [row["motor_rad"] != "" for row in rows] == [False, True, True, False, False, False]
    assert float(rows[1]["motor_rad"]) == pytest.approx(80.0 * np.radians(HIDDEN_DEG[1]), abs=0.02)
    assert "motor_rad is empty for axes 4, 5, 6:" in "\n".join(comments)


def test_what_wrong_lengths_leave_on_the_robot_is_in_the_table_and_in_the_sigmas(tmp_path):
    right = mastered(tmp_path / "right", "kuka-kr6-r900", "kuka-mastering")
    wrong = mastered(tmp_path / "wrong", "kuka-kr6-r900", "kuka-mastering", lengths_m=3e-4)
    for (before, _), (after, _) in zip(remaining_um(right[2]), remaining_um(wrong[2]), strict=True):
        assert after > 5.0 * before
    sigma = [[float(row["sigma_deg"]) for row in rows[1:5]] for _, rows, _ in (right, wrong)]
    assert np.all(np.array(sigma[1]) > 5.0 * np.array(sigma[0]))


def test_the_table_of_a_whole_model_names_the_command_that_fills_it(tmp_path, capsys):
    folder, out = tracked(tmp_path / "session", "kuka-kr6-r900", lengths_m=1e-4), tmp_path / "model.json"
    assert run(["identify", str(folder), "--out", str(out)]) == 0
    assert "calibeam identify REC --zeros-only" in " ".join(capsys.readouterr().out.split())
    assert run(["export-model", str(out), "--to", "kuka-mastering"]) == 0
    rows, comments = offsets(tmp_path / "model.kuka-mastering.csv")
    assert not any(row["offset_deg"] for row in rows)
    assert sum("calibeam identify REC --zeros-only" in line for line in comments) == 1


def test_a_plan_of_ones_own_is_refused_with_zeros_only(tmp_path, capsys):
    folder, plan = tracked(tmp_path / "session", "kuka-kr6-r900", rows=8), tmp_path / "fit.toml"
    plan.write_text("schema = 1\n")
    words = ["identify", str(folder), "--zeros-only", "--plan", str(plan), "--out", str(tmp_path / "zeros.json")]
    assert run(words) == 1
    assert "give --zeros-only without --plan" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "zeros.json").exists()
