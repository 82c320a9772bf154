"""How the examinations of `compare` and `reconcile` end, by recordings that agree, differ, or hold too little."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from calibeam.cli import run
from calibrate.compare.comparison_examinations import COMPARE_EXAMINATIONS
from calibrate.compare.reconciled_rows import RECONCILE_EXAMINATIONS
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

NOISE_M, ZERO_RAD = 1e-5, 2e-3
READINGS, CAUSES, STREAMS, ZEROS, TORQUES = (one.what for one, _ in COMPARE_EXAMINATIONS)
POSES = RECONCILE_EXAMINATIONS[0].what


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("healthy")
    write_case(conceal(Wanted("tracker", 5, defects=(), samples=40, arm="irb120")), folder)
    return folder / "recording"


@pytest.fixture
def other(measured, tmp_path):
    """The same poses with noise of their own; `zero_rad`: of joint 3, which reads so much more."""

    def made(zero_rad=0.0, rows=None, name="other"):
        folder, rng = Path(shutil.copytree(measured, tmp_path / name)), np.random.default_rng(3)
        path = folder / "samples.csv"
        with path.open(newline="", encoding="utf-8") as file:
            table = list(csv.DictReader(file))[:rows]
        for row in table:
            row |= {name: repr(float(row[name]) + rng.normal(0.0, NOISE_M)) for name in ("x_m", "y_m", "z_m")}
            row["q3_rad"] = repr(float(row["q3_rad"]) + zero_rad)
        with path.open("w", newline="", encoding="utf-8") as file:
            out = csv.DictWriter(file, table[0])
            out.writeheader()
            out.writerows(table)
        return folder

    return made


def compared(tmp_path, *arguments):
    out = tmp_path / "compare.json"
    assert run(["compare", *map(str, arguments), "--out", str(out)]) == 0
    said = json.loads(out.read_text())
    assert [one["what"] for one in said["examinations"]] == [one.what for one, _ in COMPARE_EXAMINATIONS]
    return said, {one["what"]: one for one in said["examinations"]}


def test_readings_that_agree_state_their_limit_and_what_neither_has_is_not_expected(measured, other, tmp_path, capsys):
    said, endings = compared(tmp_path, measured, other())
    assert said["verdict"] == "consistent"
    assert (endings[READINGS]["outcome"], endings[READINGS]["unit"]) == ("nothing found", "m")
    assert 0.5 * NOISE_M < endings[READINGS]["limit"] < 2.0 * NOISE_M
    assert endings[CAUSES]["outcome"] == "nothing found"
    assert "gear-ratio-error at joint1.angle" in endings[CAUSES]["says"]
    for name in (STREAMS, ZEROS, TORQUES):
        assert (endings[name]["outcome"], endings[name]["expected"]) == ("not examined", False)
        assert endings[name]["reason"]
        assert endings[name]["remedy"]


def test_a_zero_that_differs_is_found_in_the_readings(measured, other, tmp_path):
    said, endings = compared(tmp_path, measured, other(ZERO_RAD))
    assert said["verdict"] == "mismatch"
    assert (endings[READINGS]["outcome"], endings[CAUSES]["outcome"]) == ("found", "nothing found")
    assert "zero of joint 3 differs" in endings[READINGS]["says"]


@pytest.mark.parametrize(
    ("zero_rad", "verdict", "outcome"), [(0.0, "consistent", "nothing found"), (ZERO_RAD, "mismatch", "found")]
)
def test_without_a_search_the_causes_are_not_examined_and_the_readings_are(
    measured, other, tmp_path, zero_rad, verdict, outcome
):
    said, endings = compared(tmp_path, measured, other(zero_rad), "--no-diagnose")
    assert (said["verdict"], endings[READINGS]["outcome"]) == (verdict, outcome)
    assert endings[READINGS]["unit"] == ("" if zero_rad else "m")
    assert ("position" in endings[READINGS]["says"]) == bool(zero_rad)
    assert (endings[CAUSES]["outcome"], endings[CAUSES]["expected"]) == ("not examined", True)
    assert "leave --no-diagnose out" in endings[CAUSES]["remedy"]


def reconciled(tmp_path, measured, simulation):
    out = tmp_path / "reconcile"
    assert run(["reconcile", str(measured), "--simulation", str(simulation), "--out", str(out)]) == 0
    said = json.loads((out / "reconcile.json").read_text())
    assert [one["what"] for one in said["examinations"]] == [one.what for one in RECONCILE_EXAMINATIONS]
    return said, {one["what"]: one for one in said["examinations"]}


def test_a_reconciliation_that_agrees_states_its_limit(measured, tmp_path):
    said, endings = reconciled(tmp_path, measured, measured / "rig.toml")
    assert (said["verdict"], endings[POSES]["outcome"], endings[POSES]["unit"]) == ("agree", "nothing found", "m")
    assert 0.0 < endings[POSES]["limit"] < 1e-3
    assert (endings[TORQUES]["outcome"], endings[TORQUES]["expected"]) == ("not examined", False)


def test_too_few_poses_that_agree_are_not_examined_and_the_remedy_is_stated(other, tmp_path):
    said, endings = reconciled(tmp_path, other(rows=8), other(rows=8, name="simulated"))
    assert said["verdict"] == "undecided"
    assert (endings[POSES]["outcome"], endings[POSES]["expected"]) == ("not examined", True)
    assert "measure more poses" in endings[POSES]["remedy"]


def test_too_few_poses_that_differ_are_no_examination_without_a_finding(other, tmp_path):
    folder = other(rows=8)
    said, endings = reconciled(tmp_path, folder, folder / "rig.toml")
    assert said["verdict"] == "differ"
    assert (endings[POSES]["outcome"], endings[POSES]["says"]) == ("found", said["says"])
