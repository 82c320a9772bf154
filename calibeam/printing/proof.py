"""The table of a proof in the terminal."""

from collections.abc import Sequence

from rich.table import Table

from calibeam.console import Console
from calibeam.prove.record import CaseScore, ProofFile
from calibeam.prove.tally import (
    OF_TROUBLES,
    Share,
    TallyLine,
    at_once,
    between_encoders,
    by,
    by_effect,
    by_enr,
    by_fault,
    by_trouble,
    figures,
)


def print_proof(console: Console, proof: ProofFile) -> None:
    """All sums; each case stands in the file and on the page."""
    cases = proof.cases
    console.print(_lines("one hidden effect, by effect over noise", by_enr(cases)))
    console.print(_lines("effect over noise >= 0.6, by instrument", by(cases, lambda c: c.family)))
    console.print(_lines("effect over noise >= 0.6, by the way of the recording", by(cases, lambda c: c.path)))
    console.print(_lines("several at once", [at_once(cases, "three"), at_once(cases, "eighteen")]))
    console.print(_lines("effect over noise >= 0.6, by mechanism", by_effect(cases)))
    console.print(_lines("faults of motion, stamps and second encoders, in streams", by_fault(cases)))
    if found := between_encoders(cases):
        console.print(_lines("between the two encoders of a joint", found))
    if troubles := by_trouble(cases):
        console.print(_troubles(troubles))
    console.print(_figures(cases))
    for case in cases:
        if case.error:
            console.print(f"{case.name}: {case.error}", markup=False, highlight=False)


def _lines(title: str, lines: Sequence[TallyLine]) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in ("", "n", "located", "named", "or among alternatives", "others reported, a case"):
        table.add_column(heading)
    for line in lines:
        if line.located.n:
            shares = (share.brief for share in line.shares)
            table.add_row(line.label, str(line.located.n), *shares, line.others)
    return table


def _troubles(lines: Sequence[tuple[str, tuple[Share, ...]]]) -> Table:
    table = Table("", *OF_TROUBLES, title="troubles that were met on real robots", title_justify="left")
    for label, (count, *shares) in lines:
        table.add_row(label, str(count.k), *(share.brief for share in shares))
    return table


def _figures(cases: Sequence[CaseScore]) -> Table:
    table = Table(title="uncertainty and proof", title_justify="left")
    for heading in ("", "measured", "wanted"):
        table.add_column(heading)
    for figure in figures(cases):
        table.add_row(figure.label, figure.said, figure.wanted)
    return table
