"""A foreign dual-PSD folder whose rig says nothing of its drawing: identified, predicted, reported, and said so."""

import re

import msgspec
import pytest

from calibeam.cli import run
from calibeam.devices.site import check_session
from calibrate.model.model_file import read_model
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("foreign")
    write_case(conceal(Wanted("dual-psd", seed=11, samples=120, places=3)), where)
    rig = where / "recording" / "rig.toml"
    rig.write_text(re.sub(r"\[tolerance\]\n(?:\w.*\n?)*", "", rig.read_text()))
    assert "tolerance" not in rig.read_text()
    return where / "recording"


@pytest.mark.usefixtures("bare_figures")
def test_such_a_folder_is_identified_predicted_and_reported(folder, tmp_path, capsys):
    model, page = tmp_path / "model.json", tmp_path / "report.html"
    assert run(["identify", str(folder), "--out", str(model)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no [tolerance]: links assumed to ± 5 mm, 10 mrad, PSD 2 in PSD 1 to ± 1 mm, 5 mrad" in said
    found = read_model(model)
    assert found.rms_distance_after_m < 5e-6
    lines = {p.name: p.undetermined for p in found.parameters}
    assert lines["link6.twist"].startswith("known from its assumed tolerance only")
    assert [name for name, why in lines.items() if name.endswith(".zero") and why is None] == [
        f"joint{k}.zero" for k in (2, 3, 4, 5)
    ]
    assert run(["predict", str(model), str(folder / "samples.csv"), "--out", str(tmp_path / "p.csv")]) == 0
    assert run(["report", str(folder), "--model", str(model), "--out", str(page)]) == 0
    assert "The rig file has no [tolerance]" in page.read_text()


def test_a_session_may_be_begun_with_such_a_rig(rig):
    check_session(msgspec.structs.replace(rig, tolerance=None))
