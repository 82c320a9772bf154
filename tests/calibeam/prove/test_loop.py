"""`calibeam prove --loop`: its table, its refusals; and one case of it as a whole, which takes minutes."""

import json

import pytest

from calibeam.cli import run
from calibeam.prove.loop import HEAD, LoopCase, summary, table_text

GOOD = LoopCase("case-0001", "none", "tracker", "in process", (), (), 3.0, 1.0, 1.0, 1.1, "agree", "")
HIDDEN = ("backlash at joint1.angle",)
BAD = LoopCase("case-0000", "one", "wire", "on wires", HIDDEN, (), None, None, None, None, "", "a | b")


def test_the_table_has_every_column_of_every_case():
    head, rule, *rows = table_text((BAD, GOOD)).splitlines()
    assert {line.count("|") for line in (head, rule, *rows)} == {len(HEAD) + 1}
    assert rows[0].startswith("| case-0000 | one | wire | on wires | backlash at joint1.angle | nothing | - | - | - |")
    assert rows[0].endswith("| - | - | a / b |")
    assert rows[1].endswith("| nothing | nothing | 3 | 1 | 1 | 1.1 | agree | none |")


def test_the_summary_counts_what_ended_and_what_was_said_too_early():
    far = LoopCase("case-0002", "one", "wire", "in process", HIDDEN, HIDDEN, 9.0, 2.0, 1.5, 1.4, "agree", "1.5 times")
    text = "\n".join(summary((BAD, GOOD, far)))
    assert "cases: 3, 2 reconciled, 1 without a failure" in text
    assert "1.250 times the noise in the median" in text
    assert "verdict agree: 2, of these 1 above 1.3 times the noise" in text
    assert "nothing hidden (1): nothing found in 1" in text


def test_no_cases_are_refused(tmp_path, capsys):
    assert run(["prove", "--loop", "--cases", "0", "--out", str(tmp_path / "out")]) == 1
    assert "at least one case" in capsys.readouterr().err


@pytest.mark.endure
def test_a_case_is_reconciled_blindly_and_then_opened(tmp_path):
    out = tmp_path / "out"
    assert run(["prove", "--loop", "--cases", "1", "--seed", "2", "--jobs", "1", "--out", str(out)]) == 0
    (case,) = json.loads((out / "loop.json").read_bytes())["cases"]
    assert case["verdict"] in ("agree", "differ")
    assert case["after"] <= 1.3 or case["verdict"] == "differ"
    assert (out / "answers" / case["name"] / "page.html").is_file()
    assert case["name"] in (out / "loop.md").read_text(encoding="utf-8")
