"""Which causes several robots share: one robot's trouble is its own, that of many comes from a part or a method."""

from collections.abc import Iterable
from dataclasses import dataclass

from calibeam.fleet.row import Row


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
