"""How an examination of a recording or a file ended: found, nothing found, or not examined.

`import`, `check`, `diagnose`, `compare` and `reconcile` have a tuple of registered examinations each, and every one of
them leaves at least one record. "No fault found" is printed only where `all_examined`: what was not examined is listed,
with its reason and what would make it possible.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec

from acquisition.recording.files.bounds import Label, Sentence, Statistic

Ending = Literal["found", "nothing found", "not examined"]
FOUND, NOTHING, NOT_EXAMINED = "found", "nothing found", "not examined"
NO_REMEDY = "no remedy is needed"  # of what the rig does not have; such lines are not printed
NOT_EXAMINED_LINE = f"{NOT_EXAMINED}: "


class ExaminationRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One examination, of one place where it has several. ValueError where its ending lacks what belongs to it."""

    what: Label  # as registered
    outcome: Ending
    where: Label = ""  # "joint3", "stream psd"; empty: of the whole recording
    says: Sentence = ""  # what was found
    limit: Statistic | None = None  # the smallest size that would have been found, in `unit`; None: no single number
    unit: Label = ""
    reason: Sentence = ""  # why it was not examined
    remedy: Sentence = ""  # what makes the examination possible
    expected: bool = False  # not examined, although the rig or the recording has what it is about

    def __post_init__(self) -> None:
        if self.outcome == FOUND and not self.says:
            raise ValueError(f"{self.what}: found, but not what")
        if self.outcome == NOTHING and self.limit is None and not self.says:
            raise ValueError(f"{self.what}: nothing found, but no detection limit")
        if self.outcome == NOT_EXAMINED and not (self.reason and self.remedy):
            raise ValueError(f"{self.what}: not examined, but no reason or no remedy")


@dataclass(frozen=True)
class Examination:
    """What a command examines: its name, the columns or channels it needs, and how to make it possible."""

    what: str
    needs: tuple[str, ...]
    remedy: str

    def found(self, says: str, where: str = "") -> ExaminationRecord:
        return ExaminationRecord(self.what, FOUND, where, says)

    def nothing(self, limit: float | None, unit: str, where: str = "", says: str = "") -> ExaminationRecord:
        """`says`: the detection limit in words, where it is no single number."""
        return ExaminationRecord(self.what, NOTHING, where, says, limit, unit)

    def not_examined(
        self, reason: str, where: str = "", *, expected: bool = True, remedy: str = ""
    ) -> ExaminationRecord:
        """`expected`: the rig or the recording has what the examination is about."""
        return ExaminationRecord(
            self.what, NOT_EXAMINED, where, reason=reason, remedy=remedy or self.remedy, expected=expected
        )


def all_examined(records: Iterable[ExaminationRecord]) -> bool:
    """Whether something was examined, and everything that rig and recording allow."""
    endings = list(records)
    return any(one.outcome != NOT_EXAMINED for one in endings) and not any(one.expected for one in endings)


def not_examined(records: Iterable[ExaminationRecord]) -> tuple[ExaminationRecord, ...]:
    """Those that did not take place; what was expected comes first."""
    left = (one for one in records if one.outcome == NOT_EXAMINED)
    return tuple(sorted(left, key=lambda one: not one.expected))


def examined_names(records: Sequence[ExaminationRecord]) -> tuple[str, ...]:
    """Names of what was examined, at some of its places at least."""
    return tuple(dict.fromkeys(one.what for one in records if one.outcome != NOT_EXAMINED))


def not_examined_lines(records: Sequence[ExaminationRecord]) -> Iterator[str]:
    """One line for each examination and reason, with its places and its remedy; one for all that lack the same."""
    groups: dict[tuple[str, str], list[ExaminationRecord]] = {}
    for one in (one for one in not_examined(records) if one.remedy != NO_REMEDY):
        groups.setdefault((one.what if one.expected else "", one.reason), []).append(one)
    for (_, reason), alike in groups.items():
        names = ", ".join(dict.fromkeys(one.what for one in alike))
        places = ", ".join(one.where for one in alike if one.where)
        yield f"{NOT_EXAMINED_LINE}{names}{f' ({places})' if places else ''}: {reason}; {alike[0].remedy}"
