"""The published table of `make prove`: its lines, and what is worse than its brackets allow."""

import re
from dataclasses import dataclass
from pathlib import Path

TABLE = Path(__file__).parent / "data" / "expected" / "proof.md"
SHARE = re.compile(r"(\d+)\s%\s\((\d+)\D(\d+)")  # 59 % (39-77)
LOWER_IS_BETTER = ("false alarms", "misnamed", "reported as consistent", "failed", "worse by")


@dataclass(frozen=True)
class Share:
    """A share of cases in per cent with its 95 % bracket."""

    percent: int
    low: int
    high: int


@dataclass(frozen=True)
class Line:
    """One line of the table. `n` is how many were concealed; `None` where it depends on what was found."""

    label: str
    n: int | None
    shares: tuple[Share, ...]


def frozen_table() -> Path:
    return TABLE


def lines(table: str) -> dict[str, Line]:
    """Label -> line, of all lines that hold a share."""
    found: dict[str, Line] = {}
    for row in table.splitlines():
        cells = [cell.strip() for cell in row.strip().strip("|").split("|")]
        shares = tuple(Share(*map(int, match.groups())) for cell in cells[1:] if (match := SHARE.search(cell)))
        if shares:
            n = int(cells[1]) if cells[1].isdigit() else None
            found[cells[0]] = Line(cells[0], n, shares)
    return found


def worse(measured: str, published: str) -> list[str]:
    """A sentence for each line that is missing, counts other cases, or is worse than the published bracket.

    What is better than its bracket is no fault: then the table is to be published anew.
    """
    now, said = lines(measured), lines(published)
    misses = []
    for label, line in said.items():
        if label not in now:
            misses.append(f"{label}: missing")
            continue
        if now[label].n != line.n:
            misses.append(f"{label}: {now[label].n} cases, published {line.n}")
        lower = any(word in label for word in LOWER_IS_BETTER)
        for one, bracket in zip(now[label].shares, line.shares, strict=True):
            if one.percent > bracket.high if lower else one.percent < bracket.low:
                misses.append(f"{label}: {one.percent} %, published {bracket.percent} % ({bracket.low}-{bracket.high})")
    return misses
