"""A reconciliation in a terminal: the verdict, how far on unseen rows, what was left out, what remains."""

from collections.abc import Sequence

from rich.console import Console

from calibeam.results.reconciliation import ReconcileFile
from calibrate.report.quantities import length

MOST = 5  # lines of a list, cut at the width of the terminal; all of them stand whole in the file


def print_reconciliation(console: Console, file: ReconcileFile) -> None:
    """At most 25 lines at usual widths."""
    console.print(f"[bold]{file.verdict}[/bold]: {file.says}", highlight=False)
    for one in file.unseen:
        parts = (
            f"{what} {length(value)} ({over:.3g} of the noise)"
            for what, value, over in (
                ("before", one.before_m, one.before),
                ("after geometry", one.geometry_m, one.geometry),
                ("after physics", one.after_m, one.after),
            )
        )
        _say(console, f"{one.instrument}, {one.rows} unseen rows, rms: " + ", ".join(parts))
    _list(console, "left out of the simulation:", [one.says for one in file.left_out])
    _list(console, "what remains:", file.remains)
    _list(console, "what to do next:", file.next if file.remains else ())


def _list(console: Console, title: str, lines: Sequence[str]) -> None:
    if not lines:
        return
    _say(console, title)
    for line in lines[:MOST]:
        console.print(f"  {line}", highlight=False, markup=False, no_wrap=True, overflow="ellipsis")
    if len(lines) > MOST:
        _say(console, f"  {len(lines) - MOST} more stand in reconcile.json")


def _say(console: Console, line: str) -> None:
    console.print(line, highlight=False, markup=False)
