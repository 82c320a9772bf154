"""The first screen of every report: how good is this robot now, can I trust it, what to do; and the numbers.

Colour only repeats what a mark and a word say.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from calibrate.report.elements import Html, bullets, join, tag
from calibrate.report.tiles import tile
from calibrate.report.verdict import Trust, Verdict

MARKS = {
    Trust.GOOD: ("\N{HEAVY CHECK MARK}", "Yes"),
    Trust.CARE: ("!", "With care"),
    Trust.NONE: ("\N{HEAVY MULTIPLICATION X}", "No"),
}
NOTHING_AGAINST = "Nothing speaks against it: what remains is noise."
NOTHING_TO_DO = "Nothing now. Measure again after a collision, a repair, or when the work gets worse."


@dataclass(frozen=True)
class Number:
    """One of the numbers of the first screen."""

    key: str  # for scripts
    name: str
    value: float | None  # None: not determined; `said` tells so
    unit: str  # "m", or "1" of a count
    said: str  # value and unit for a person
    about: str  # what it is, in one line


@dataclass(frozen=True)
class Answers:
    """All of the first screen."""

    verdict: Verdict
    numbers: tuple[Number, ...]
    known: tuple[str, ...] = ()  # what to know before the numbers are used: what is missing, what limits
    also: tuple[str, ...] = ()  # smaller numbers, in words
    drift: str = ""  # what changed since another calibration, in one sentence
    warnings: tuple[str, ...] = ()  # what to know before that sentence is believed


def first_screen(answers: Answers) -> Html:
    """Verdict, numbers and the line below them."""
    judged = answers.verdict
    mark, word = MARKS[judged.trust]
    why = (*judged.reasons, *answers.known)
    rows = [
        _row("How good is it now?", tag("strong", judged.sentence)),
        _row("Can I trust it?", tag("b", tag("span", mark, cls="mark", aria_hidden="true"), word), *_listed(why)),
        *([_row("What has changed?", *_listed((*answers.warnings, answers.drift)))] if answers.drift else []),
        _row("What to do?", *_listed(judged.advice, NOTHING_TO_DO)),
    ]
    tiles = tag("div", *(tile(n.name, n.said, n.about) for n in answers.numbers), cls="tiles")
    below = [tag("p", " · ".join(answers.also), cls="also")] if answers.also else []
    return tag("div", tag("div", *rows, cls=f"verdict {judged.trust.value}"), tiles, *below, cls="answers")


def _row(question: str, *content: str) -> Html:
    return tag("div", tag("h2", question), tag("div", *content), cls="answer")


def _listed(said: Sequence[str], otherwise: str = NOTHING_AGAINST) -> list[Html]:
    if not said:
        return [tag("p", otherwise)]
    told = [coded(text) for text in said]
    return [tag("p", told[0])] if len(told) == 1 else [bullets(told)]


def coded(text: str) -> Html:
    """What stands between backticks as code."""
    return join(*(tag("code", part) if i % 2 else part for i, part in enumerate(text.split("`"))))
