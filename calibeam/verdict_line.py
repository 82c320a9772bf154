"""The first sentence of a report as the last words in a terminal, so that both say the same."""

from collections.abc import Iterator

from rich.console import Console

from calibrate.report.answers import Answers
from calibrate.report.verdict import Trust, Verdict

COLOUR = {Trust.GOOD: "green", Trust.CARE: "yellow", Trust.NONE: "red"}


def print_verdict(console: Console, judged: Verdict) -> None:
    """How far to trust what was found, and every reason for care."""
    console.print(f"\n{judged.sentence}", style=f"bold {COLOUR[judged.trust]}", highlight=False, markup=False)
    for reason in judged.reasons:
        console.print(f"  {reason}", highlight=False, markup=False)


def verdict_words(answers: Answers) -> Iterator[str]:
    """The first screen of a report in a few lines: verdict, drift, what to do."""
    yield answers.verdict.sentence
    yield from (f"  {reason}" for reason in answers.verdict.reasons)
    yield from answers.warnings
    if answers.drift:
        yield answers.drift
    yield from (f"to do: {advice}" for advice in answers.verdict.advice)
