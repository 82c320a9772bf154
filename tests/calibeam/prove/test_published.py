"""The public table is that of a file, goes between its marks, and never comes of a seed of development."""

from collections.abc import Callable

import pytest

from benchmarks.proof_comparison import ComparisonFile
from benchmarks.proof_oracle import DIAGNOSIS, GEOMETRY, BaselineScore, Compared
from benchmarks.proof_table import BEGIN, END, table_of, wanted_words, with_table
from calibeam.prove.record import SCHEMA, CaseScore, DefectScore, ProofFile
from calibeam.prove.tally import ProofFigure
from calibrate.errors import DataError

Case = Callable[..., CaseScore]
Found = Callable[..., DefectScore]
NOTHING = ComparisonFile(0.0, {})


@pytest.fixture
def proof(case: Case, found: Found) -> Callable[..., ProofFile]:
    def make(
        *, seed: int = 20261121, without: tuple[str, ...] = (), command: str = "calibeam prove --publish"
    ) -> ProofFile:
        plain = case((found(enr=1.2),))
        wired = case((found(enr=2.5, named=False),), name="case-0001", path="on wires")
        return ProofFile(SCHEMA, "calibeam 1", seed, seed < 1000, command, "", 600.0, (plain, wired), without)

    return make


def test_every_figure_has_its_line(proof: Callable[..., ProofFile]) -> None:
    scores = (BaselineScore(GEOMETRY, 3e-5, 0.0, ""), BaselineScore(DIAGNOSIS, 1e-5, 0.98, ""))
    compared = ComparisonFile(120.0, {"case-0000": Compared(3e-5, 1e-5, 0.9e-5, scores)})
    table = table_of(proof(), compared).replace("\u00a0", " ").replace("\u2011", "-")
    assert "Seed 20261121, 2 sessions, 12 minutes" in table
    assert "| held-out gain, share of the oracle's, median and p10 | 0.98, 0.98 (n 1) | >= 0.97, 0.85 |" in table
    assert "| geometry only | 0, 0 (n 1) |" in table
    assert "| all of 0.6 and more | 2 | 100 % (34-100) | 50 %" in table
    assert "| of these, over the emulated wires | 1 | 100 % (21-100) | 0 %" in table
    assert "| tracker | 1 | 30.0 µm | 10.0 µm | 9.00 µm |" in table
    assert "oracle" not in table_of(proof(), NOTHING)
    assert all(line.startswith("| ") for line in table.splitlines() if "---" in line)


def test_development_is_not_for_the_public(proof: Callable[..., ProofFile]) -> None:
    with pytest.raises(DataError, match="reserved for development"):
        table_of(proof(seed=21), NOTHING)
    with pytest.raises(DataError, match="taken out"):
        table_of(proof(without=("backlash",)), NOTHING)
    with pytest.raises(DataError, match="not made to be published"):
        table_of(proof(command="calibeam prove --kind one --enr 3 8"), NOTHING)


def test_the_table_goes_between_its_marks_and_nothing_else_changes() -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    assert with_table(text, "new\n", "figures.md") == f"before\n{BEGIN}\nnew\n{END}\nafter\n"
    assert with_table(with_table(text, "new\n", ""), "newer\n", "") == f"before\n{BEGIN}\nnewer\n{END}\nafter\n"


def test_a_text_without_marks_is_refused() -> None:
    with pytest.raises(DataError, match=r"figures.md: no lines <!-- proof: begin -->"):
        with_table("no marks", "new\n", "figures.md")


@pytest.mark.parametrize(
    ("said", "wanted", "missed"),
    [
        ("6 % (1-27, n 17)", "<= 6 %", False),
        ("11 % (4-28, n 27)", "<= 5 %", True),
        ("89 % (72-96, n 27)", ">= 90 %", True),
        ("5 % (1-25, n 19)", "none", True),
        ("100 % (80-100, n 19)", "all", False),
        ("87 % (81-91, n 167)", "93 - 97 %", True),
        ("1.04, 1.16 (n 91)", "<= 1.05, 1.15", True),
        ("1, 0.9 (n 16)", ">= 0.97, 0.85", False),
        ("0.387, 1.05 (n 117)", "", False),
        ("3.62, 7.9 (n 222)", "<= 5", False),
    ],
)
def test_a_target_that_is_missed_is_marked_as_such(said: str, wanted: str, missed: bool) -> None:
    assert wanted_words(ProofFigure("", said, wanted)).endswith("**missed**") is missed
