"""A run over a fleet: what is new or changed is judged by workers, every row is kept as it comes, then all are told."""

from collections.abc import Callable, Sequence, Set
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from calibeam.fleet.engine import rows
from calibeam.fleet.found import parts_of, recordings
from calibeam.fleet.journal import Journal
from calibeam.fleet.order import CHILD, Order, Task
from calibeam.fleet.row import Row
from calibeam.fleet.standing import standing
from calibeam.fleet.workers import Workers
from calibeam.outcome import interruption

Tell = Callable[[int, int, str], None]  # done, of so many, what


@dataclass(frozen=True)
class Wanted:
    """What is asked of a run."""

    diagnose: bool = False
    again: bool = False
    by_folder: bool = False  # the first folder below names the robot
    timeout_s: float | None = 900.0  # a recording; a large one with its diagnosis takes a minute
    workers: Workers = field(default_factory=Workers)
    command: tuple[str, ...] = CHILD


@dataclass(frozen=True)
class Ran:
    """How a run ended."""

    rows: tuple[Row, ...]  # of the recordings that are there now, and that are done
    kept: int  # rows of recordings that are not there any more
    stood: int  # taken from an earlier run
    left: int  # not begun or not ended when the run was stopped
    stopped: str  # by what (Ctrl-C, SIGTERM); "" where it came to its end


def run(folder: Path, out: Path, wanted: Wanted, tell: Tell) -> Ran:
    """All recordings below `folder` into the table in `out`. Ctrl-C ends it early, with what is done kept.

    DataError where there is nothing to do, RecordingError where it cannot be kept.
    """
    found = recordings(folder, out)
    with Journal(out) as journal:
        before = () if wanted.again else journal.rows
        stands = standing(found, before, diagnose=wanted.diagnose)
        groups = {str(one.path): one.group for one in found}
        parts = {str(part) for one in found for part in parts_of(one.path)} - groups.keys()
        for path in (*stands.moved, *parts):
            journal.forget(path)
        for row in stands.done:
            journal.add(_named(row, groups, wanted))
        orders = [
            Order(Task.of(one, diagnose=wanted.diagnose), wanted.timeout_s, wanted.command) for one in stands.todo
        ]
        done, stopped = _work(orders, wanted, journal, groups, tell, len(stands.done), len(found))
        if wanted.again:
            _still_to_do(journal, groups.keys() - done)
        here = tuple(row for row in journal.rows if row.path in groups)
        return Ran(here, len(journal.rows) - len(here), len(stands.done), len(orders) - len(done), stopped)


def _work(
    orders: Sequence[Order],
    wanted: Wanted,
    journal: Journal,
    groups: dict[str, str],
    tell: Tell,
    stood: int,
    total: int,
) -> tuple[set[str], str]:
    """Paths that were done, and what stopped it before all were."""
    done: set[str] = set()
    tell(stood, total, "")
    if not orders:
        return done, ""
    try:
        with closing(rows(orders, wanted.workers)) as coming:
            for row in coming:
                journal.add(_named(row, groups, wanted))
                done.add(row.path)
                tell(stood + len(done), total, row.name)
    except KeyboardInterrupt as why:
        return done, interruption(why)
    return done, ""


def _still_to_do(journal: Journal, paths: Set[str]) -> None:
    """Rows of earlier runs keep their numbers; of no version of the program, they stand for no later run."""
    for row in [row for row in journal.rows if row.path in paths]:
        journal.add(msgspec.structs.replace(row, software=""))


def _named(row: Row, groups: dict[str, str], wanted: Wanted) -> Row:
    """With the robot's name: its folder where that was asked for, else its serial number, else the rig's name."""
    robot = groups.get(row.path, "") if wanted.by_folder else ""
    return msgspec.structs.replace(row, robot=robot or row.robot_serial or row.rig)
