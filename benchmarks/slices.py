"""Results seed by seed, kept in a file: a long benchmark is taken slice by slice, and told as a whole.

    python -m benchmarks designed_poses --seeds 1:4        seeds 1, 2, 3
    python -m benchmarks designed_poses --seeds 4:7        3 more, beside those

Without --seeds all are taken again. What was kept of another rig file is forgotten; what the program was like then is
not known to the file: delete it after a change.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec

Row = TypeVar("Row")
OUT = Path(__file__).parents[1] / "out" / "benchmarks"


class Kept(msgspec.Struct, frozen=True):
    """Rows by seed, of one rig file."""

    rig_sha256: str
    rows: dict[int, dict[str, Any]]


class Slices(Generic[Row]):
    """Rows of type `row` (a dataclass with a `seed`) of the benchmark `name`."""

    def __init__(self, name: str, row: type[Row], rig_sha256: str) -> None:
        self._path, self._row, self._rig = OUT / f"{name}.json", row, rig_sha256

    def rows(self) -> list[Row]:
        """All that is kept, by seed."""
        return [msgspec.convert(row, type=self._row) for _, row in sorted(self._kept().items())]

    def forget(self) -> None:
        """Before all are taken again."""
        self._path.unlink(missing_ok=True)

    def keep(self, seed: int, row: Row) -> None:
        """One more, or one again."""
        rows = self._kept() | {seed: msgspec.to_builtins(row)}
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._path.write_bytes(msgspec.json.format(msgspec.json.encode(Kept(self._rig, rows)), indent=1) + b"\n")

    def _kept(self) -> dict[int, dict[str, Any]]:
        if not self._path.exists():
            return {}
        kept = msgspec.json.decode(self._path.read_bytes(), type=Kept)
        return kept.rows if kept.rig_sha256 == self._rig else {}


def seeds_of(text: str) -> range:
    """`a:b`: a, a + 1 ... b - 1. ValueError for anything else."""
    first, _, end = text.partition(":")
    seeds = range(int(first), int(end))
    if not seeds:
        raise ValueError(f"--seeds {text}: no seed in it; give FIRST:END, where END is the one behind the last")
    return seeds


def asked(words: Iterable[str]) -> tuple[list[str], range | None]:
    """Names of benchmarks, and the seeds behind --seeds. ValueError."""
    names, seeds, rest = list[str](), None, iter(words)
    for word in rest:
        if word == "--seeds":
            seeds = seeds_of(next(rest, ""))
        else:
            names.append(word)
    return names, seeds
