"""The table of `make prove` on its published seed: nothing is worse than its brackets."""

import subprocess
import sys
from pathlib import Path

import pytest

from .published import frozen_table, lines, worse

CASES = ("--cases", "220", "--wire", "2")  # as in the Makefile, without the comparison with other libraries


@pytest.mark.endure
@pytest.mark.timeout(7200)
def test_the_published_table_holds(tmp_path: Path) -> None:
    text = tmp_path / "table.md"
    text.write_text("<!-- proof: begin -->\n<!-- proof: end -->\n", encoding="utf-8")
    _run("calibeam", "prove", *CASES, "--publish", "--out", tmp_path / "proof")
    _run("benchmarks.proof_table", tmp_path / "proof" / "proof.json", text)
    assert worse(text.read_text(encoding="utf-8"), frozen_table().read_text(encoding="utf-8")) == []


def _run(*words: str | Path) -> None:
    done = subprocess.run([sys.executable, "-m", *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def test_a_table_that_is_worse_than_its_brackets_is_reported() -> None:
    table = frozen_table().read_text(encoding="utf-8")
    assert len(lines(table)) == 24
    assert worse(table, table) == []
    plain = next(row for row in table.splitlines() if row.startswith("| all of 0.6 and more"))
    fewer = table.replace(plain, plain.replace("97\xa0%", "87\xa0%", 1).replace("| 59 |", "| 58 |"))
    assert worse(fewer, table) == [
        "all of 0.6 and more: 58 cases, published 59",
        "all of 0.6 and more: 87 %, published 97 % (88-99)",
    ]
    alarms = next(row for row in table.splitlines() if row.startswith("| false alarms, heavy noise"))
    assert len(worse(table.replace(alarms, alarms.replace("6\xa0%", "28\xa0%", 1)), table)) == 1
    assert worse(table.replace(alarms, alarms.replace("6\xa0%", "0\xa0%", 1)), table) == []
    assert worse(table.replace(alarms, ""), table) == ["false alarms, heavy noise: missing"]
