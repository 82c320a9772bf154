"""`python -m benchmarks fleet`: how long a fleet takes against the number of files, the workers and the engine.

The time of a run is start-up plus a rate; its exponent over the number of files is fitted to whole runs, so start-up
makes it less than 1, and anything that grows with what is done already (a table written again for every row, say) more.
"""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.fleet_sessions import Robot, write_fleet
from calibeam.fleet.drift import FAMILY, Series, find_drifts_in
from calibeam.fleet.recordings import Engine, Workers
from calibeam.fleet.run import RunOptions, run

FILES = (12, 24, 48)
SAMPLES = 40  # the least that is still identified: what is measured is the spreading
MOST_EXPONENT = 1.1  # exponent that a run may have
FLEETS = 1000


def lines(folder: Path, files: Sequence[int] = FILES) -> Iterator[str]:
    """One line a run, then the exponent, and seconds a file beyond the start of each engine."""
    write_fleet(folder / "all", [Robot(f"R{i:02d}", 40 + i) for i in range(max(files) // 4)], samples=SAMPLES)
    first: float | None = None
    for name, workers, counts in (
        ("loky, 2 workers", Workers(Engine.LOKY, 2), files),
        ("loky, 1 worker", Workers(Engine.LOKY, 1), (files[0], files[-1])),
        ("dask, 2 workers", Workers(Engine.DASK, 2), (files[0], files[-1])),
    ):
        seconds: list[float] = []
        for count in counts:
            seconds.append(_timed(folder, count, workers))
            yield f"{name}, {count:3d} files: {seconds[-1]:6.2f} s"
        rate = (seconds[-1] - seconds[0]) / (counts[-1] - counts[0])
        first = first or rate
        start = seconds[0] - rate * counts[0]
        yield f"{name}: {rate:.2f} s a file, {rate / first:.2f} times loky with 2; start {start:.1f} s"
        exponent = float(np.polyfit(np.log(counts), np.log(seconds), 1)[0])
        reached = "reached" if exponent <= MOST_EXPONENT else "NOT reached"
        yield f"{name}: exponent of time over files {exponent:.2f} (wanted <= {MOST_EXPONENT}: {reached})"


def _timed(folder: Path, count: int, workers: Workers) -> float:
    some = folder / f"{count} of them"
    some.mkdir(exist_ok=True)
    for path in sorted((folder / "all").glob("*/*.mcap"))[:count]:
        link = some / f"{path.parent.name}-{path.name}"
        if not link.exists():
            link.hardlink_to(path)
    begun = time.perf_counter()
    ran = run(some, folder / "out", RunOptions(again=True, workers=workers), lambda done, total, name: None)
    assert all(row.good for row in ran.rows), [row.error for row in ran.rows if not row.good]
    assert len(ran.rows) == count
    return time.perf_counter() - begun


def false_drift_lines() -> Iterator[str]:
    """Fleets of 20 zeros without drift, 3 to 6 dates each: in how many any is said to drift."""
    cases = {
        "scatter as stated": np.ones(20),
        "scatter half of what is stated": np.full(20, 0.5),
        "scatter three times what is stated": np.full(20, 3.0),
        "as stated, two of 20 three times": np.array([3.0] * 2 + [1.0] * 18),
    }
    for name, scatter in cases.items():
        rng = np.random.default_rng(1)
        said = sum(any(one.significant for one in find_drifts_in(_still(rng, scatter)).lines) for _ in range(FLEETS))
        yield f"{name}: a drift is said in {said} of {FLEETS} fleets without one (wanted <= {FAMILY:.0%})"


def found_drift_lines() -> Iterator[str]:
    """Of 20 zeros on four dates one drifts: how often it is said, by its size."""
    for ratio in (3.0, 4.0, 5.0, 6.0, 8.0):
        rng, said = np.random.default_rng(2), 0
        for _ in range(FLEETS // 5):
            year = np.array([0.0, 0.3, 0.6, 1.0])
            slope = ratio / float(np.sqrt(np.sum((year - year.mean()) ** 2)))  # in sigma of the slope
            zero = [rng.standard_normal(4) + (slope * year if k == 0 else 0.0) for k in range(20)]
            found = find_drifts_in([_series(k, year, z) for k, z in enumerate(zero)])
            said += any(one.significant and one.series.joint == 0 for one in found.lines)
        yield f"a drift of {ratio:g} sigma on four dates is said in {said} of {FLEETS // 5} fleets"


def _still(rng: np.random.Generator, scatter: np.ndarray) -> list[Series]:
    years = [np.sort(rng.uniform(0.0, 3.0, rng.integers(3, 7))) for _ in scatter]
    return [_series(k, y, s * rng.standard_normal(len(y))) for k, (y, s) in enumerate(zip(years, scatter, strict=True))]


def _series(number: int, year: np.ndarray, zero: np.ndarray) -> Series:
    return Series("r", number, year, 1e-5 * zero, np.full(len(year), 1e-5))
