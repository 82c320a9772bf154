"""Are blunders found and named, and healthy sessions left alone? Counts by instrument and mistake.

A mistake that the data cannot show is no miss and is counted apart: the nominal arm then explains the spoilt file as
well as the true one, so nobody could separate them by these data.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.random import Generator

from acquisition.recording import Samples, read
from acquisition.recording.rig import Rig
from benchmarks.healthy import INSTRUMENTS, Drawn
from benchmarks.with_mistakes import ROWS, WHOLE_FILE, Made, Mistake
from calibrate.errors import DataError
from calibrate.fit.identify.identify import without_gross_errors
from calibrate.fit.identify.wrong_file import refuse_wrong_file
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.checks.witness import Strain
from calibrate.model.parameters import start_values
from calibrate.model.sensors.catalogue import witnesses_of

REAL = ("ur5-tracker", "ur10-leica-a", "ur10-leica-b", "ur10-leica-d")
REAL_ROWS = 200  # drawn from all over the real session for every seed, in their order
NO_WORSE = 2.0  # times the strain of the healthy session: half of what is taken for a wrong convention
Draw = Callable[[Generator], tuple[Rig, Samples]]


@dataclass
class Count:
    """Of one mistake in one instrument's sessions."""

    found: int = 0
    row_only: int = 0  # the row is named, not the cell: one length cannot say which of seven numbers is wrong
    unseen: int = 0  # the data cannot show it
    missed: list[str] = field(default_factory=list)  # what was told instead


def sources(rig_file: Path, real: Path) -> dict[str, Draw]:
    """Drawn sessions of every instrument, and the real ones that are there."""
    drawn = Drawn(rig_file)
    out: dict[str, Draw] = {
        name: lambda rng, make=make: (drawn.rig, make(drawn, rng)) for name, make in INSTRUMENTS.items()
    }
    return out | {name: _drawn_from(real / name) for name in REAL if (real / name).is_dir()}


def false_alarms(draw: Draw, sessions: int, seed: int = 7_000) -> list[str]:
    """What was said of healthy sessions."""
    said = (outcome_of(*draw(np.random.default_rng(seed + i)), rows=True)[0] for i in range(sessions))
    return [text for text in said if text]


def counts(draw: Draw, mistakes: tuple[Mistake, ...], sessions: int, seed: int = 8_000) -> dict[str, Count]:
    """Every mistake in as many sessions, drawn again."""
    out: dict[str, Count] = defaultdict(Count)
    for mistake in mistakes:
        for i in range(sessions):
            rng = np.random.default_rng(seed + i)
            rig, samples = draw(rng)
            if mistake.needs(samples):
                _judge(out[mistake.name], rig, samples, mistake.make(samples, rng))
    return out


def outcome_of(rig: Rig, samples: Samples, *, rows: bool) -> tuple[str, frozenset[int]]:
    """All that is said of a file, and the rows (from 0) it is said of; `rows` False: of the whole file only."""
    try:
        if not rows:
            refuse_wrong_file(rig, samples)
            return "", frozenset()
        found = without_gross_errors(rig, samples)[2]
    except DataError as error:
        return str(error), frozenset()
    return "; ".join(b.says for b in found), frozenset(row for b in found for row in b.rows)


def _judge(count: Count, rig: Rig, healthy: Samples, made: Made) -> None:
    said, rows = outcome_of(rig, made.samples, rows=bool(made.rows))
    alone = made.parts or (made.samples,) * len(made.names)
    if all(name in said for name in made.names) and rows == frozenset(made.rows):
        count.found += 1
    elif made.rows and rows >= frozenset(made.rows) and len(rows) <= 2:  # of a bar, both ends
        count.row_only += 1
    elif not made.rows and all(
        name in said or _strain(rig, part) < NO_WORSE * _strain(rig, healthy)
        for name, part in zip(made.names, alone, strict=True)
    ):
        count.unseen += 1
    else:
        count.missed.append(f"{', '.join(made.names)} (row {made.rows[:1]}): {said or 'nothing said'}")


def _strain(rig: Rig, samples: Samples) -> float:
    """Of all instruments together, the file being right as it is written."""
    arm, strain = arm_of(rig), Strain(np.zeros(1), np.zeros(1))
    for witness in witnesses_of(rig, samples, samples.joints()):
        strain = strain + witness.strain(arm.flange(start_values(arm.parameters), witness.q_rad)[None])
    return float(strain.compared_m[0])


def _drawn_from(folder: Path) -> Draw:
    session = read(folder)

    def draw(rng: Generator) -> tuple[Rig, Samples]:
        rows = np.sort(rng.permutation(len(session.samples))[:REAL_ROWS])
        return session.rig, session.samples.take(rows)

    return draw


def lines(rig_file: Path, real: Path, healthy: int = 50, sessions: int = 20) -> Iterator[str]:
    """A line an instrument and mistake, as soon as it is known."""
    for name, draw in sources(rig_file, real).items():
        alarms = false_alarms(draw, healthy)
        yield f"{name:13s} {'healthy':22s} {healthy:3d} sessions, {len(alarms)} false alarms"
        yield from (f"    FALSE ALARM: {text}" for text in alarms)
        for mistake, count in counts(draw, WHOLE_FILE + ROWS, sessions).items():
            total = count.found + count.row_only + count.unseen + len(count.missed)
            yield (
                f"{name:13s} {mistake:22s} {total:3d} made, {count.found:3d} found and named, "
                f"{count.row_only:2d} by row only, {count.unseen:2d} not in the data, {len(count.missed):2d} missed"
            )
            yield from (f"    MISSED {text}" for text in count.missed)
