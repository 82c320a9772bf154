"""The verdict of a report (a degree of trust, reasons for care, advice) with its thresholds, and the first screen.

The first screen answers how good the robot is now, whether to trust that, and what to do; then the numbers. Colour only
repeats a mark and a word.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from calibrate.report.elements.html import (
    Html,
    bullets,
    join,
    tag,
    tile,
)

UNLIKELY = 0.01  # lack of fit: the usual level (Draper, Smith, Applied Regression Analysis, 1998, ch. 2.1)
WORSE_UNSEEN = 1.5  # error on unseen poses over the noise; of a healthy fit near 1
NOISIER = 3.0  # found over assumed; assumed noise is often wrong by this much, beyond it something is broken
AGAIN = "Measure again, with more and more different poses."

UNCHECKED = "There are as many unknowns as readings, or nearly so: any arm would fit, and the result cannot be checked."
MORE_POSES = "Measure more poses: at least 15, better 50, all over the workspace."

UNPROVED = "There is no proof on unseen rows: too few rows, or it was not asked for."
TO_PROVE = "Measure at least 15 poses, better 50, so that some can be kept for the proof."

ReasonForCare = tuple[str, str]  # what speaks against trust, and what to do about it


class Trust(Enum):
    """How far a result may be used, on the one scale of all pages, files and messages."""

    GOOD = "yes"
    CARE = "with care"
    NONE = "no"

    @property
    def css(self) -> str:
        """The page's class for it."""
        return {Trust.GOOD: "good", Trust.CARE: "care", Trust.NONE: "bad"}[self]


@dataclass(frozen=True)
class VerdictBox:
    """One sentence, every reason for care, and what to do."""

    trust: Trust
    sentence: str
    reasons: tuple[str, ...]
    advice: tuple[str, ...] = ()  # what to do about them


MARKS = {
    Trust.GOOD: ("\N{HEAVY CHECK MARK}", "Yes"),
    Trust.CARE: ("!", "With care"),
    Trust.NONE: ("\N{HEAVY MULTIPLICATION X}", "No"),
}
TOOL = "tool_"  # keys of the tool error begin so
NOTHING_AGAINST = "No reason for care was found: what remains is noise."
NOTHING_TO_DO = "Nothing now. Measure again after a collision or a repair, or when accuracy at work gets worse."


@dataclass(frozen=True)
class Number:
    """One of the numbers of the first screen."""

    key: str  # for scripts
    name: str
    value: float | None  # None: not determined, as `said` states
    unit: str  # "m", or "1" of a count
    said: str  # value and unit for a person
    about: str  # what it is, in one line


@dataclass(frozen=True)
class Answers:
    """All of the first screen."""

    verdict: VerdictBox
    numbers: tuple[Number, ...]
    known: tuple[str, ...] = ()  # what to know before the numbers are used: what is missing, what limits
    limit: str = ""  # the step that would make the tool error smaller, where one does
    also: tuple[str, ...] = ()  # smaller numbers, in words
    drift: str = ""  # what changed since another calibration, in one sentence
    warnings: tuple[str, ...] = ()  # what to know before that sentence is relied on


def first_screen(answers: Answers, maps: Html | None = None) -> Html:
    """Tool error, verdict, numbers and the line below them; `maps` of the tool error stand beside its number."""
    judged = answers.verdict
    mark, word = MARKS[judged.trust]
    why = (*judged.reasons, *answers.known)
    tool = [n for n in answers.numbers if n.key.startswith(TOOL)]
    rest = [n for n in answers.numbers if not n.key.startswith(TOOL)]
    rows = [
        _row("How good is it now?", *(_headline(tool, judged.sentence) if tool else (tag("strong", judged.sentence),))),
        _row("Can I trust it?", tag("b", tag("span", mark, cls="mark", aria_hidden="true"), word), *_listed(why)),
        *([_row("What has changed?", *_listed((*answers.warnings, answers.drift)))] if answers.drift else []),
        _row("What to do?", *_listed(judged.advice, NOTHING_TO_DO)),
    ]
    tiles = tag("div", *(tile(n.name, n.said, n.about) for n in rest), cls="tiles")
    below = [tag("p", " · ".join(answers.also), cls="also")] if answers.also else []
    colour = f"verdict {judged.trust.css}"
    box = tag("div", tag("div", *rows), maps, cls=f"{colour} with-maps") if maps else tag("div", *rows, cls=colour)
    return tag("div", box, tiles, *below, cls="answers")


def _headline(tool: Sequence[Number], sentence: str) -> list[Html]:
    """Nominal, calibrated, with physics in one line; or why there is no number."""
    about = tag("p", sentence)
    if all(n.value is None for n in tool):
        return [tag("strong", f"Tool error over the workspace {tool[0].about}"), about]
    values = [tag("span", tag("b", n.said), tag("span", n.name)) for n in tool]
    arrow = tag("span", "\N{RIGHTWARDS ARROW}", cls="arrow")
    parts = [values[0], *(part for value in values[1:] for part in (arrow, value))]
    return [
        tag("p", "Tool error over the workspace", cls="kicker"),
        tag("div", *parts, cls="headline"),
        tag("p", tool[-1].about, cls="lead"),
        about,
    ]


def _row(question: str, *content: str) -> Html:
    return tag("div", tag("h2", question), tag("div", *content), cls="answer")


def _listed(said: Sequence[str], otherwise: str = NOTHING_AGAINST) -> list[Html]:
    if not said:
        return [tag("p", otherwise)]
    coded_texts = [coded(text) for text in said]
    return [tag("p", coded_texts[0])] if len(coded_texts) == 1 else [bullets(coded_texts)]


def coded(text: str) -> Html:
    """What stands between backticks as code."""
    return join(*(tag("code", part) if i % 2 else part for i, part in enumerate(text.split("`"))))
