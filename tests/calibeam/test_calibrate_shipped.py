"""`calibrate` of every shipped arm before a tracker, elastic at each joint: model, diagnosis and report are written."""

import json

import pytest

from calibeam.cli import run
from calibeam.commands.rig import shipped_rigs
from tests.calibrate.apply.export.tracked import tracked

ROWS, SEED, LENGTHS_M, YIELDS_RAD_NM = 80, 4, 2e-4, 2e-5
DAILY = ("fanuc-lrmate-200id", "franka-panda", "ur5e")  # a coupled joint; seven axes; a Denavit-Hartenberg table


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in DAILY else [pytest.mark.endure]) for n in shipped_rigs()]
)
def test_an_elastic_arm_is_calibrated_with_its_physics(name, tmp_path, capsys):
    folder = tracked(
        tmp_path / "recording", name, lengths_m=LENGTHS_M, rows=ROWS, seed=SEED, yields_rad_nm=YIELDS_RAD_NM
    )
    out = tmp_path / "calibration"
    assert run(["calibrate", str(folder), "--out", str(out)]) == 0, capsys.readouterr().err
    assert sorted(path.name for path in out.iterdir()) == ["diagnosis.json", "model.json", "report.html"]
    model = json.loads((out / "model.json").read_text())
    assert model["effects"] != [], capsys.readouterr().out
