"""`calibeam prove --loop`: its table, its refusals; and one case of it as a whole, which takes minutes."""

import json

import pytest

from calibeam.cli import run
from calibeam.prove.loop import HEAD, LoopCase, table_text

GOOD = LoopCase("case-0001", "none", "tracker", (), (), 3.0, 1.0, 1.0, "agree", "")
BAD = LoopCase("case-0000", "one", "wire", ("backlash at joint1.angle",), (), None, None, None, "", "a | b")


def test_the_table_has_every_column_of_every_case():
    head, rule, *rows = table_text((BAD, GOOD)).splitlines()
    assert {line.count("|") for line in (head, rule, *rows)} == {len(HEAD) + 1}
    assert rows[0].startswith("| case-0000 | one | wire | backlash at joint1.angle | nothing | - | - | - | - | a / b |")
    assert rows[1].endswith("| nothing | nothing | 3 | 1 | 1 | agree | none |")


def test_no_cases_are_refused(tmp_path, capsys):
    assert run(["prove", "--loop", "--cases", "0", "--out", str(tmp_path / "out")]) == 1
    assert "cases, jobs 1 or more" in capsys.readouterr().err


@pytest.mark.endure
def test_a_case_is_reconciled_blindly_and_then_opened(tmp_path):
    out = tmp_path / "out"
    assert run(["prove", "--loop", "--cases", "1", "--seed", "2", "--jobs", "1", "--out", str(out)]) == 0
    (case,) = json.loads((out / "loop.json").read_bytes())["cases"]
    assert case["verdict"] in ("agree", "differ")
    assert case["after"] <= 1.3 or case["verdict"] == "differ"
    assert (out / "answers" / case["name"] / "page.html").is_file()
    assert case["name"] in (out / "loop.md").read_text(encoding="utf-8")
