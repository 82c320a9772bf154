"""`diagnose`: diagnosis.json and pages beside it, faults of a file told and written, one sentence for the rest."""

import json

import msgspec
import pytest

from calibeam.cli import run
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A tracker before a small arm whose second joint's encoder disc is off centre."""
    where = tmp_path_factory.mktemp("concealed")
    wanted = Wanted("tracker", 31, defects=("encoder-eccentricity",), enr=2.0, samples=100, arm="irb120")
    write_case(conceal(wanted), where)
    return where / "recording"


@pytest.fixture(scope="module")
def out(folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("out") / "diagnosis.json"
    assert run(["diagnose", str(folder), "--out", str(path)]) == 0
    return path


def test_the_file_and_its_pages_are_written(out):
    said = json.loads(out.read_text())
    assert (said["schema"], said["verdict"]) == (1, "mismatch")
    assert said["rms_after_m"] < said["rms_before_m"]
    page = out.with_suffix(".html").read_text(encoding="utf-8")
    assert said["findings"][0]["where"] in page
    assert 'id="finding-1"' in page


@pytest.mark.usefixtures("bare_figures")
def test_the_report_of_the_session_takes_the_pages_up(folder, out, tmp_path):
    page = tmp_path / "report.html"
    assert run(["report", str(folder), "--diagnosis", str(out), "--out", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert text.index('id="errors"') < text.index('id="finding-1"') < text.index('id="provenance"')


def test_a_file_in_degrees_is_reported_written_and_ends_with_1(folder, tmp_path, capsys):
    wrong = tmp_path / "degrees"
    wrong.mkdir()
    (wrong / "rig.toml").write_text((folder / "rig.toml").read_text())
    head, *rows = (folder / "samples.csv").read_text().splitlines()
    at = [i for i, name in enumerate(head.split(",")) if name.startswith("q") and name.endswith("_rad")]
    cells = [row.split(",") for row in rows]
    for row in cells:
        for i in at:
            row[i] = repr(float(row[i]) * 57.29577951308232)
    (wrong / "samples.csv").write_text("\n".join([head, *(",".join(row) for row in cells)]) + "\n")
    path = tmp_path / "d.json"
    assert run(["diagnose", str(wrong), "--out", str(path), "--json"]) == 1
    said = json.loads(path.read_text())
    assert (said["verdict"], said["findings"]) == ("undecidable", [])
    assert "degrees" in said["blunders"][0]["kind"]
    printed = capsys.readouterr()
    assert msgspec.json.decode(printed.out) == said
    assert "degrees" in printed.err
    assert str(wrong) in printed.err


def test_of_too_few_rows_it_is_written_that_nothing_is_decided(folder, tmp_path, capsys):
    few = tmp_path / "few"
    few.mkdir()
    (few / "rig.toml").write_text((folder / "rig.toml").read_text())
    (few / "samples.csv").write_text("\n".join((folder / "samples.csv").read_text().splitlines()[:16]) + "\n")
    path = tmp_path / "d.json"
    assert run(["diagnose", str(few), "--out", str(path)]) == 0
    said = json.loads(path.read_text())
    assert (said["verdict"], said["findings"]) == ("undecidable", [])
    assert "measure more poses" in " ".join(capsys.readouterr().out.split())
    assert path.with_suffix(".html").is_file()


def test_a_model_of_another_rig_is_refused(folder, tmp_path, capsys):
    other = tmp_path / "other"
    other.mkdir()
    (other / "rig.toml").write_text((folder / "rig.toml").read_text() + "# another file\n")
    (other / "samples.csv").write_text((folder / "samples.csv").read_text())
    model = tmp_path / "model.json"
    assert run(["identify", str(other), "--out", str(model)]) == 0
    assert run(["diagnose", str(folder), "--model", str(model), "--out", str(tmp_path / "d.json")]) == 1
    assert "another than that" in capsys.readouterr().err


def test_a_recording_that_is_not_there_is_one_sentence(tmp_path, capsys):
    assert run(["diagnose", str(tmp_path / "none.mcap"), "--out", str(tmp_path / "d.json")]) == 1
    assert "none.mcap" in capsys.readouterr().err
