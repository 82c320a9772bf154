"""The commands of docs/tutorial.md run as they stand, from the Excel sheet to the corrected program."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from calibeam.cli import run

DOCS = Path(__file__).parents[2] / "docs"
COMMANDS = re.findall(r"^calibeam (.*)$", (DOCS / "tutorial.md").read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.usefixtures("bare_figures")
def test_the_tutorial_leads_from_a_sheet_to_a_corrected_program(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(shutil.copytree(DOCS / "examples" / "lab", tmp_path / "tutorial"))
    assert [line.split()[0] for line in COMMANDS] == ["import", "identify", "report", "correct"]
    printed = {}
    for line in COMMANDS:
        assert run(shlex.split(line)) == 0, line
        printed[line.split()[0]] = capsys.readouterr().out
    misses = re.findall(r"by\s([\d.]+)\s.m", printed["identify"])
    after, before = misses[:2]
    assert float(before) == pytest.approx(505.0, rel=0.02)
    assert float(after) == pytest.approx(38.1, rel=0.02)
    assert "not a literal" not in printed["correct"]
    assert "line 4: predicted tool error 688 ± 15 µm, corrected 0 ± 15 µm" in printed["correct"]
    corrected = Path("weld-corrected.script").read_text(encoding="utf-8")
    assert corrected != Path("weld.script").read_text(encoding="utf-8")
    assert corrected.count("movel(p[") == 3
