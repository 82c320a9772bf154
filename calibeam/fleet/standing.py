"""What need not be done again: the same content, by the same program, at least as thoroughly."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import msgspec

from calibeam.fleet.found import Found, content_sha256
from calibeam.fleet.row import Outcome, Row
from calibeam.software import SOFTWARE


@dataclass(frozen=True)
class Standing:
    """How the recordings of a folder stand against the rows of earlier runs."""

    done: tuple[Row, ...]  # one a recording that stands, with the path it has now
    todo: tuple[Found, ...]
    moved: tuple[str, ...]  # paths under which rows stood of what now lies elsewhere


def standing(found: Sequence[Found], rows: Iterable[Row], *, diagnose: bool) -> Standing:
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
    return Standing(tuple(done), tuple(todo), tuple(moved))


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
