"""Zeros of one joint of one robot over time, gathered from the rows of a fleet."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from calibeam.fleet.row import Row

Floats = NDArray[np.float64]

YEAR_S = 365.25 * 86400.0


@dataclass(frozen=True)
class Series:
    """In the order of time."""

    robot: str
    joint: int
    year: Floats  # (date,) years since 1970
    zero_rad: Floats  # (date,) drawn and correction together, less than half a turn from one date to the next
    sigma_rad: Floats  # (date,)

    @property
    def dates(self) -> int:
        """Different ones."""
        return len(set(self.year.tolist()))


def all_series(rows: Iterable[Row]) -> tuple[Series, ...]:
    """Of every robot and joint with a date and a zero; of copies of one recording the first, and none of no trust."""
    found: dict[tuple[str, int], list[tuple[float, float, float]]] = {}
    seen: set[str] = set()
    for row in rows:
        year = year_of(row.started_utc)
        if not row.good or row.trust == "bad" or year is None or row.sha256 in seen:
            continue
        seen.add(row.sha256)
        for zero in row.zeros:
            if zero.value_rad is not None and zero.sigma_rad:
                found.setdefault((row.robot, zero.joint), []).append(
                    (year, zero.drawn_rad + zero.value_rad, zero.sigma_rad)
                )
    return tuple(_series(robot, joint, points) for (robot, joint), points in sorted(found.items()))


def _series(robot: str, joint: int, points: Iterable[tuple[float, float, float]]) -> Series:
    year, zero_rad, sigma_rad = np.array(sorted(points)).T
    return Series(robot, joint, year, np.unwrap(zero_rad), sigma_rad)


def year_of(started_utc: str) -> float | None:
    """Years since 1970, None for what is no ISO date."""
    try:
        started = datetime.fromisoformat(started_utc)
    except ValueError:
        return None
    return (started if started.tzinfo else started.replace(tzinfo=UTC)).timestamp() / YEAR_S
