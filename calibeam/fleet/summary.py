"""A fleet in short: counts, drifts, shared causes, failures, for the terminal, the page and --json.

A cause that one robot shows is its own; a cause that several robots share comes from a part or a method.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from calibeam.fleet.drift import Drift, Drifts, find_drifts
from calibeam.fleet.row import Outcome, Row
from calibrate.quantities import angle, angle_with_sigma, significant


@dataclass(frozen=True)
class Shared:
    """A cause, and in how many of its diagnosed recordings each robot shows it."""

    where: str
    physics: str
    robots: dict[str, tuple[int, int]]  # robot -> recordings with it, recordings diagnosed; all robots with either

    @property
    def count(self) -> int:
        """Robots that show it at least once."""
        return sum(shown > 0 for shown, _ in self.robots.values())


def diagnosed(rows: Iterable[Row]) -> list[Row]:
    """Rows that a diagnosis was made of; of copies of one recording the first."""
    first: dict[str, Row] = {}
    for row in rows:
        if row.good and row.verdict:
            first.setdefault(row.sha256, row)
    return list(first.values())


def causes(rows: Iterable[Row]) -> tuple[Shared, ...]:
    """Every cause that was found, those of most robots first."""
    asked = diagnosed(rows)
    total: dict[str, int] = {}
    shown: dict[tuple[str, str], dict[str, int]] = {}
    for row in asked:
        total[row.robot] = total.get(row.robot, 0) + 1
        for key in {(cause.where, cause.physics) for cause in row.causes}:
            robots = shown.setdefault(key, {})
            robots[row.robot] = robots.get(row.robot, 0) + 1
    found = [
        Shared(where, physics, {robot: (robots.get(robot, 0), n) for robot, n in sorted(total.items())})
        for (where, physics), robots in shown.items()
    ]
    return tuple(sorted(found, key=lambda one: (-one.count, one.physics, one.where)))


SHARED_BY = 2  # robots: from here on a cause is no single arm's trouble


@dataclass(frozen=True)
class Fleet:
    """All rows that stand, and what is worked out from them."""

    rows: tuple[Row, ...]

    @cached_property
    def robots(self) -> tuple[str, ...]:
        """Names, sorted; of recordings that failed before their rig could be read none is known."""
        return tuple(sorted({row.robot for row in self.rows if row.robot}))

    @cached_property
    def good(self) -> tuple[Row, ...]:
        return tuple(row for row in self.rows if row.good)

    @cached_property
    def bad(self) -> tuple[Row, ...]:
        """Failed or lost."""
        return tuple(row for row in self.rows if row.outcome in (Outcome.FAILED, Outcome.LOST))

    @cached_property
    def torn(self) -> tuple[Row, ...]:
        """Identified by what was left of a recording that was cut short or damaged."""
        return tuple(row for row in self.good if not row.complete)

    @cached_property
    def empty(self) -> tuple[Row, ...]:
        return tuple(row for row in self.rows if row.outcome is Outcome.EMPTY)

    @cached_property
    def drifts(self) -> Drifts:
        """Of every zero that was seen on enough dates."""
        return find_drifts(self.rows)

    @property
    def lines(self) -> tuple[Drift, ...]:
        return self.drifts.lines

    @cached_property
    def drifting(self) -> tuple[Drift, ...]:
        return tuple(drift for drift in self.lines if drift.significant)

    @cached_property
    def causes(self) -> tuple[Shared, ...]:
        return causes(self.rows)

    @cached_property
    def shared(self) -> tuple[Shared, ...]:
        return tuple(cause for cause in self.causes if cause.count >= SHARED_BY)

    @cached_property
    def diagnosed(self) -> int:
        """Different recordings that were diagnosed."""
        return len(diagnosed(self.rows))

    def newest(self) -> tuple[Row, ...]:
        """The last good recording of every robot, by its start; where none is known, the last by name.

        One that was cut short stands for a robot only where no whole one does.
        """
        last: dict[str, Row] = {}
        for row in sorted(self.good, key=lambda row: (row.complete, row.started_utc, row.name)):
            last[row.robot] = row
        return tuple(last[robot] for robot in sorted(last))


def drift_words(drift: Drift) -> str:
    """One sentence for a person."""
    slope = angle_with_sigma(drift.slope_rad_year, drift.sigma_rad_year)
    return (
        f"{drift.series.robot}: the zero of joint {drift.series.joint} drifts by {slope} a year "
        f"({angle(drift.change_rad)} over {len(drift.series.year)} recordings, p = {significant(drift.p, 2)})"
    )


def shared_words(cause: Shared) -> str:
    """One sentence for a person."""
    return f"{cause.physics} at {cause.where}: {cause.count} of {len(cause.robots)} robots"


def method_words(found: Drifts) -> str:
    """What was tested, and how the number of tests was allowed for."""
    lines = found.lines
    robots = len({drift.series.robot for drift in lines})
    more = (
        f" The zeros of the fleet scatter {significant(found.scatter, 2)} times as much as their sigmas predict; all "
        "are "
        "widened by it."
        if found.scatter > 1.0
        else ""
    )
    return (
        f"{len(lines)} zeros of {robots} robots were seen on three dates or more and tested for a drift. By Holm's "
        "procedure the chance that any of them is reported to drift where none does is at most 5 %, over all together."
        + more
    )
