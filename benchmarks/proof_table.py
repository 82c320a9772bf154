"""`python -m benchmarks.proof_table proof.json docs/figures.md`: the table of a proof, between two marks of a text.

So that the table is never typed, and always that of a file; with what `benchmarks.proof_comparison` left beside it.
"""

import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec

from benchmarks.proof_comparison import (
    ComparisonFile,
    by_instrument,
    by_method,
    oracle_figures,
    pairs_of,
    read_comparison,
)
from calibeam.prove.record import PLAIN, CaseScore, ProofFile
from calibeam.prove.tally import (
    ProofFigure,
    TallyLine,
    at_once,
    by_enr,
    figures,
    plain,
)
from calibrate.errors import DataError

NUMBER = re.compile(r"\d+(?:\.\d+)?")
BEGIN, END = "<!-- proof: begin -->", "<!-- proof: end -->"


def table_of(proof: ProofFile, comparison: ComparisonFile) -> str:
    """Markdown. DataError for a proof that was not made to be published: no figure of it is for the public."""
    if proof.development or proof.without:
        why = f"seed {proof.seed} is reserved for development" if proof.development else "effects were taken out"
        raise DataError(f"{why}; publish the table of a `calibeam prove --publish`")
    if "--publish" not in proof.command.split():
        raise DataError("this proof was not made to be published; make it with `make prove`")
    cases, pairs = proof.cases, pairs_of(proof, comparison)
    minutes = (proof.wall_s + comparison.wall_s) / 60
    lines = [
        f"Seed {proof.seed}, {len(cases)} sessions, {minutes:.0f} minutes (`make prove`); brackets are 95 %.",
        "",
        *_findings(cases),
        "",
        *_rows(
            ("uncertainty and proof", "measured", "wanted"),
            [(f.label, f.said, wanted_words(f)) for f in (*figures(cases), *oracle_figures(pairs))],
        ),
    ]
    if others := by_method(pairs):
        head = ("held-out gain, share of the oracle's", "median, p10")
        lines += ["", *_rows(head, [(f.label, f.said) for f in others])]
    free = by_instrument(pairs)
    if free:
        head = (
            "tool error over the workspace against the truth, median",
            "cases",
            "geometry",
            "with what was found",
            "oracle",
        )
        lines += ["", *_rows(head, [f.cells for f in free])]
    return "\n".join(lines) + "\n"


def _findings(cases: Sequence[CaseScore]) -> list[str]:
    """One effect by size, all plain ones together, several at once, and those over the wires."""
    lines = [
        *by_enr(cases),
        plain(cases, f"all of {PLAIN:g} and more"),
        at_once(cases, "three"),
        at_once(cases, "eighteen"),
        plain([c for c in cases if c.path == "on wires"], "of these, over the emulated wires"),
        replace(at_once(cases, "streams"), label="faults found in streams"),
    ]
    head = (
        "hidden, effect over noise",
        "n",
        "located",
        "named",
        "named or among alternatives",
        "others reported, a case",
    )
    return _rows(head, [_cells(line) for line in lines if line.located.n])


def _cells(line: TallyLine) -> tuple[str, ...]:
    return (line.label, str(line.located.n), *(share.brief for share in line.shares), line.others)


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    cells = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(row) + " |" for row in cells]


def wanted_words(figure: ProofFigure) -> str:
    """What was wanted, marked where the measured value itself misses it; its bracket may reach farther."""
    return f"{figure.wanted}, **missed**" if _missed(figure) else figure.wanted or " "


def _missed(figure: ProofFigure) -> bool:
    wanted = {"none": "<= 0", "all": ">= 100"}.get(figure.wanted, figure.wanted)
    measured = [float(number) for number in NUMBER.findall(figure.said.partition("(")[0])]
    bounds = [float(number) for number in NUMBER.findall(wanted)]
    if wanted.startswith("<="):
        return any(value > most for value, most in zip(measured, bounds, strict=False))
    if wanted.startswith(">="):
        return any(value < least for value, least in zip(measured, bounds, strict=False))
    return bool(bounds and measured) and not bounds[0] <= measured[0] <= bounds[-1]


def with_table(text: str, table: str, name: str) -> str:
    """The text with the table between its marks. DataError where it has none."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise DataError(f"{name}: no lines {BEGIN} and {END}, between which the table goes; add them")
    return f"{before}{BEGIN}\n{table}{END}{after}"


def main(proof: Path, text: Path) -> None:
    """Writes the table into the text."""
    file = msgspec.json.decode(proof.read_bytes(), type=ProofFile)
    old = text.read_text(encoding="utf-8")
    table = table_of(file, read_comparison(proof.parent))
    text.write_text(with_table(old, table, text.name), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
