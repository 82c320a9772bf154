"""A run over a fleet: workers read what is new or changed, and every row is kept as it comes.

A recording is not read again if its content and the program are the same and it was diagnosed as thoroughly.
"""

from collections.abc import Callable, Iterable, Sequence, Set
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from calibeam.fleet.engine import run_orders
from calibeam.fleet.recordings import Found, Workers, content_sha256, find_recordings, parts_of
from calibeam.fleet.row import CHILD, Order, Outcome, Row, Task
from calibeam.fleet.table import Journal
from calibeam.outcome import interruption
from calibeam.software import SOFTWARE

Tell = Callable[[int, int, str], None]  # done, of so many, what


@dataclass(frozen=True)
class RunOptions:
    """What is asked of a run."""

    diagnose: bool = False
    again: bool = False
    by_folder: bool = False  # the first folder below names the robot
    timeout_s: float | None = 900.0  # a recording; a large one with its diagnosis takes a minute
    workers: Workers = field(default_factory=Workers)
    command: tuple[str, ...] = CHILD


@dataclass(frozen=True)
class RunResult:
    """How a run ended."""

    rows: tuple[Row, ...]  # of the recordings that are there now, and that are done
    kept: int  # rows of recordings that are not there any more
    stood: int  # taken from an earlier run
    left: int  # not begun or not ended when the run was stopped
    stopped: str  # by what (Ctrl-C, SIGTERM); "" where it came to its end


def run(folder: Path, out: Path, wanted: RunOptions, tell: Tell) -> RunResult:
    """All recordings below `folder` into the table in `out`. Ctrl-C ends it early, with what is done kept.

    DataError where there is nothing to do, RecordingError where it cannot be kept.
    """
    found = find_recordings(folder, out)
    with Journal(out) as journal:
        before = () if wanted.again else journal.rows
        stands = find_unchanged(found, before, diagnose=wanted.diagnose)
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
        return RunResult(here, len(journal.rows) - len(here), len(stands.done), len(orders) - len(done), stopped)


def _work(
    orders: Sequence[Order],
    wanted: RunOptions,
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
        with closing(run_orders(orders, wanted.workers)) as coming:
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


def _named(row: Row, groups: dict[str, str], wanted: RunOptions) -> Row:
    """With the robot's name: its folder where that was asked for, else its serial number, else the rig's name."""
    robot = groups.get(row.path, "") if wanted.by_folder else ""
    return msgspec.structs.replace(row, robot=robot or row.robot_serial or row.rig)


@dataclass(frozen=True)
class Unchanged:
    """How the recordings of a folder stand against the rows of earlier runs."""

    done: tuple[Row, ...]  # one a recording that stands, with the path it has now
    todo: tuple[Found, ...]
    moved: tuple[str, ...]  # paths under which rows stood of what now lies elsewhere


def find_unchanged(found: Sequence[Found], rows: Iterable[Row], *, diagnose: bool) -> Unchanged:
    """What is unchanged by size and time, or by content where only name or time changed, stands."""
    good = [row for row in rows if _stands(row, diagnose=diagnose)]
    by_path = {row.path: row for row in good}
    by_size: dict[int, list[Row]] = {}
    for row in good:
        by_size.setdefault(row.size_bytes, []).append(row)
    here = {str(one.path) for one in found}
    done: list[Row] = []
    todo: list[Found] = []
    moved: list[str] = []
    for one in found:
        row = by_path.get(str(one.path))
        if row is None or (row.size_bytes, row.modified_ns) != (one.size_bytes, one.modified_ns):
            row = _same_content(one, by_size.get(one.size_bytes, []))
        if row is None or row.started_utc != (one.date or row.started_utc):
            todo.append(one)
            continue
        if row.path not in here:
            moved.append(row.path)
        done.append(msgspec.structs.replace(row, path=str(one.path), name=one.name, modified_ns=one.modified_ns))
    return Unchanged(tuple(done), tuple(todo), tuple(moved))


def _stands(row: Row, *, diagnose: bool) -> bool:
    thorough = row.diagnosed or not diagnose
    return row.outcome is not Outcome.LOST and row.software == SOFTWARE and thorough and bool(row.sha256)


def _same_content(one: Found, rows: Sequence[Row]) -> Row | None:
    if not rows:
        return None
    with suppress(OSError):
        sha256 = content_sha256(one.path)
        return next((row for row in rows if row.sha256 == sha256), None)
    return None
