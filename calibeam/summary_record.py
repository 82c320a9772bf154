"""The first screen of a report for scripts: what `calibeam report --json` prints, version 1 (docs/report.md)."""

from pathlib import Path
from typing import Literal

import msgspec

from calibrate.report.answers import Answers
from calibrate.report.verdict import Trust

WORDS = {Trust.GOOD: "yes", Trust.CARE: "with care", Trust.NONE: "no"}


class NumberRecord(msgspec.Struct, frozen=True):
    """A number of the first screen; null where it cannot be told, `about` then says why."""

    value: float | None
    unit: str
    about: str


class SummaryRecord(msgspec.Struct, frozen=True):
    """All of the first screen."""

    schema: Literal[1]
    kind: Literal["calibeam-report"]
    report: str
    trust: str  # "yes", "with care", "no"
    verdict: str
    reasons: tuple[str, ...]
    known: tuple[str, ...]
    advice: tuple[str, ...]
    numbers: dict[str, NumberRecord]
    drift: str | None
    warnings: tuple[str, ...]


def summary_of(answers: Answers, path: Path) -> SummaryRecord:
    """Of the report at `path`."""
    judged = answers.verdict
    return SummaryRecord(
        1,
        "calibeam-report",
        str(path),
        WORDS[judged.trust],
        judged.sentence,
        judged.reasons,
        answers.known,
        judged.advice,
        {n.key: NumberRecord(n.value, n.unit, n.about) for n in answers.numbers},
        answers.drift or None,
        answers.warnings,
    )
