"""`calibeam import` of a laboratory's table: shown, asked for once, written; and what leads to it."""

import json
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from acquisition.recording import read
from calibeam.asking import Asking
from calibeam.cli import run
from calibeam.commands import import_files
from tests.calibeam.typist import Typist

ROOT = Path(__file__).parents[2]
RIG = ROOT / "docs" / "examples" / "lab" / "rig.toml"
HEADINGS = [*(f"A{i}" for i in range(1, 7)), "X", "Y", "Z", "Remark"]
STATED = "A1..A6 [deg] = q, X Y Z [mm] = position"


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """lab.xlsx in the working folder, degrees and millimetres without a word of it; the joints in rad."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    q_rad, xyz_m = rng.uniform(-2.0, 2.0, (9, 6)), rng.uniform(0.5, 2.0, (9, 3))
    book = openpyxl.Workbook()
    for row in (HEADINGS, *([*np.degrees(q), *(1e3 * x), "ok"] for q, x in zip(q_rad, xyz_m, strict=True))):
        book.active.append(list(row))
    book.save("lab.xlsx")
    return q_rad


def command(*more):
    return run(["import", "lab.xlsx", "--rig", str(RIG), "--out", "session", *more])


def test_yes_writes_what_is_stated(lab, capsys):
    assert command("--columns", STATED, "--yes") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "A1 … A6" in shown
    assert "not used: Remark" in shown
    np.testing.assert_allclose(read("session").samples.joints(), lab, rtol=1e-12)
    about = json.loads(Path("session.columns.json").read_text())
    assert about["unused"] == ["Remark"]


def test_an_open_unit_is_refused_where_nobody_is_asked(lab, capsys):
    assert command("--yes") == 1
    lines = capsys.readouterr().err
    assert "columns 'A1' …: no unit stands there" in lines
    assert '--columns "A1 A2 A3 A4 A5 A6 [deg] = q"' in lines
    assert not Path("session").exists()


def test_nothing_is_written_without_an_answer(lab, capsys, monkeypatch):
    monkeypatch.setattr(import_files, "at_terminal", lambda: None)
    assert command("--columns", STATED) == 1
    assert "give --yes when they are" in capsys.readouterr().err
    assert not Path("session").exists()


@pytest.fixture
def person(monkeypatch):
    typist = Typist()
    monkeypatch.setattr(import_files, "at_terminal", lambda: Asking(typist.terminal))
    monkeypatch.setattr("calibeam.asking.in_foreground", lambda _: True)
    yield typist
    typist.close()


def test_a_person_answers_units_and_agrees_once(lab, person):
    person.answers("ENTER: 1] ", "\n", "\n")  # degrees, millimetres: as proposed
    person.answers("q to end: ", "\n")
    assert command() == 0
    assert "(position): no unit stands there" in person.screen
    np.testing.assert_allclose(read("session").samples.joints(), lab, rtol=1e-12)


def test_a_person_who_does_not_agree_gets_nothing(lab, person, capsys):
    person.answers("q to end: ", "q\n")
    assert command("--columns", STATED) == 1
    assert "state them with --columns" in capsys.readouterr().err
    assert not Path("session").exists()


@pytest.mark.parametrize("name", ["identify", "export"])
def test_who_reads_a_table_is_led_here(lab, name, capsys):
    assert run([name, "lab.xlsx", "--out", "out"]) == 1
    lines = capsys.readouterr().err
    assert "calibeam import lab.xlsx --rig RIG.toml --out lab" in lines
    assert "MCAP" not in lines


def test_the_table_of_a_session_folder_means_the_folder(lab, capsys):
    assert command("--columns", STATED, "--yes") == 0
    assert run(["export", "session/samples.csv", "--out", "again"]) == 0
    assert Path("again/samples.csv").read_text() == Path("session/samples.csv").read_text()
    assert run(["import", "session/samples.csv", "--out", "session.mcap"]) == 0
    assert len(read("session.mcap").samples) == len(lab)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["lab.xlsx", "--out", "s"], "give --rig RIG.toml"),
        (["lab.xlsx", "--rig", str(RIG), "--out", "s.mcap"], "give the name of a folder"),
        (["lab.pdf", "--rig", str(RIG), "--out", "s"], "neither a session folder nor one of"),
        (["missing.xlsx", "--rig", str(RIG), "--out", "s"], "cannot read the workbook"),
        (["missing.csv", "--rig", str(RIG), "--out", "s"], "cannot read it"),
        ([".", "lab.xlsx", "--out", "s.mcap"], "a session folder is imported by itself"),
        (["lab.xlsx", "lab.xlsx", "--rig", str(RIG), "--out", "s"], "give --streams for several logs"),
        (
            ["lab.csv", "--streams", "--rig", str(RIG), "--out", "s.mcap", "--sheet", "Two"],
            "only a workbook has sheets",
        ),
        (["lab.xlsx", "--rig", str(RIG), "--out", "s", "--sheet", "Two"], "no sheet 'Two'; there are Sheet"),
    ],
)
def test_what_cannot_be_imported_is_reported_in_one_sentence(lab, arguments, says, capsys):
    assert run(["import", *arguments]) == 1
    assert says in capsys.readouterr().err


TARGET_RIG = "[[target]]\nid = {0}\npoint_m = [0.0, 0.0{0}, 0.08]\n"


def tracked(tmp_path, cells, heading="Reflector"):
    """A table of poses of several reflectors, and its rig file."""
    rig, table = tmp_path / "rig.toml", tmp_path / "lab.csv"
    rig.write_text(RIG.read_text() + "".join(TARGET_RIG.format(k) for k in (1, 2, 3)))
    names = [*(f"q{j}_rad" for j in range(1, 7)), "x_m", "y_m", "z_m", heading]
    rows = np.random.default_rng(3).uniform(0.5, 1.5, (len(cells), 9)).tolist()
    lines = [",".join(map(str, (*row, cell))) for row, cell in zip(rows, cells, strict=True)]
    table.write_text("\n".join([",".join(names), *lines]) + "\n")
    return run(["import", str(table), "--rig", str(rig), "--out", str(tmp_path / "session"), "--yes"])


@pytest.mark.parametrize("cells", [(1, 2, 3), ("R1", "R2", "R3"), ("SMR 1", "SMR 2", "SMR 3")])
def test_a_column_of_reflectors_is_the_target_of_each_row(tmp_path, cells):
    assert tracked(tmp_path, cells * 3) == 0
    assert read(tmp_path / "session").samples.integers("target", 0).tolist() == [1, 2, 3] * 3


def test_a_reflector_without_a_number_is_refused_with_what_to_do(tmp_path, capsys):
    assert tracked(tmp_path, ("R1", "left", "R3")) == 1
    lines = capsys.readouterr().err
    assert "row 3, column 'Reflector': 'left'" in lines
    assert "'Reflector' = unused" in lines
