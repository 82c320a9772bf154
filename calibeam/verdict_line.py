"""The first sentence of a report as the last words in a terminal, so that both say the same."""

from rich.console import Console

from calibrate.report.verdict import Trust, Verdict

COLOUR = {Trust.GOOD: "green", Trust.CARE: "yellow", Trust.NONE: "red"}


def print_verdict(console: Console, judged: Verdict) -> None:
    """How far to trust what was found, and every reason for care."""
    console.print(f"\n{judged.sentence}", style=f"bold {COLOUR[judged.trust]}", highlight=False, markup=False)
    for reason in judged.reasons:
        console.print(f"  {reason}", highlight=False, markup=False)
