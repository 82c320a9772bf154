"""What must hold in a table of settled samples, and the only way to make one: columns of cells to checked `Samples`.

Every fault names place and column; a fault of a whole column has row None.
"""

import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.bounds import LENGTH_M, most_of
from acquisition.recording.files.plausible import time_fault
from acquisition.recording.rig import Rig
from acquisition.recording.samples import (
    COMPLETE_PER_JOINT,
    ORIENTATION,
    POSITION,
    SPOTS,
    TARGET,
    Cell,
    Kind,
    Samples,
    joint_of,
    kind_of,
    per_joint,
    required,
)

Table = Mapping[str, NDArray[Any]]
Fault = tuple[int | None, str, str]  # row from 0, column, what is wrong and what to do
Place = Callable[[int | None], str]  # row from 0, None for the whole table -> where that is, for a person

LONGEST_NAME = 200  # characters, as of all names
LONGEST_TEXT = 40  # characters: the texts that a column of samples may hold have one
_WHOLE_LIMIT = 2.0**53  # beyond, float64 has no unit step


def checked_samples(
    columns: Mapping[str, Sequence[Cell]], rig: Rig, place: Place, *, joints_needed: bool = True
) -> Samples:
    """The table of these cells. SamplesError naming file, row, column, value and remedy for the first fault.

    `joints_needed`: else a table without any joint angle has NaN for them.
    """
    joints = per_joint("q", "_rad", rig.n_joints)
    if without := not joints_needed and not any(name in columns for name in joints):
        columns = {**columns, **dict.fromkeys(joints, [None] * max(map(len, columns.values()), default=0))}
    for fault in _header_faults(tuple(columns), rig.n_joints):
        raise _error(fault, place)
    table: dict[str, NDArray[Any]] = {}
    for name, cells in columns.items():
        try:
            table[name] = _array(name, cells)
        except _BadCellError as bad:
            raise _error((bad.row, name, bad.says), place) from None
    needed = ("t_s",) if without else required(rig.n_joints)
    first = min(_table_faults(table, rig, needed), key=lambda fault: -1 if fault[0] is None else fault[0], default=None)
    if first is not None:
        raise _error(first, place)
    return Samples(table, rig.n_joints)


def no_samples(rig: Rig) -> Samples:
    """The empty table of a rig."""
    return Samples({name: np.empty(0) for name in required(rig.n_joints)}, rig.n_joints)


class _BadCellError(ValueError):
    """One cell that is not what its column holds."""

    def __init__(self, row: int, says: str) -> None:
        super().__init__(says)
        self.row, self.says = row, says


def _error(fault: Fault, place: Place) -> SamplesError:
    row, column, says = fault
    return SamplesError(f"{place(row)}, column '{shown(column, 60)}': {says}")


def _header_faults(names: tuple[str, ...], n_joints: int) -> Iterator[Fault]:
    for name in required(n_joints):
        if name not in names:
            near = difflib.get_close_matches(
                name, [n for n in names if len(n) <= LONGEST_NAME and joint_of(n) is None], n=1
            )
            hint = f"; is it '{shown(near[0], 60)}'?" if near else ""
            yield None, name, f"the column is missing; the rig's arm has {n_joints} joints{hint}"
    for name in names:
        if len(name) > LONGEST_NAME:
            yield None, name, f"the name has {len(name)} characters; at most {LONGEST_NAME} are read, shorten it"
        joint = joint_of(name)
        if joint is not None and not 1 <= joint <= n_joints:
            yield (
                None,
                name,
                f"there is no joint {joint}: the rig's arm has {n_joints} joints; correct one of the two files",
            )
    for stem, unit in COMPLETE_PER_JOINT:
        yield from _incomplete(names, per_joint(stem, unit, n_joints))
    yield from _incomplete(names, POSITION)
    if any(name in names for name in ORIENTATION):
        yield from _incomplete(names, (*ORIENTATION, *POSITION))
    yield from _incomplete(names, SPOTS)
    if any(name in names for name in SPOTS):
        yield from _incomplete(names, (*SPOTS, "placement", "first_psd"))
    yield from _incomplete(names, ("bar", "bar_end"))


def _incomplete(names: tuple[str, ...], group: tuple[str, ...]) -> Iterator[Fault]:
    present = [name for name in group if name in names]
    if present:
        for name in group:
            if name not in names:
                yield None, name, f"the column is missing, though '{present[0]}' is there; the two belong together"


def _array(name: str, cells: Sequence[Cell]) -> NDArray[Any]:
    if kind_of(name) is Kind.TEXT:
        texts = ("" if cell is None else str(cell) for cell in cells)
        return np.array([text[:LONGEST_TEXT] for text in texts], dtype=np.str_)  # all as wide as the longest
    numbers = [float("nan") if cell is None else _number(row, cell) for row, cell in enumerate(cells)]
    array = np.array(numbers, dtype=np.float64)
    if infinite := np.flatnonzero(np.isinf(array)).tolist():
        raise _BadCellError(
            infinite[0], f"{array[infinite[0]]} is not a finite number; leave the cell empty if it is missing"
        )
    if beyond := np.flatnonzero(np.abs(array) > most_of(name)).tolist():
        metres = most_of(name) == LENGTH_M
        remedy = "write metres (millimetres divided by 1000)" if metres else "correct it"
        raise _BadCellError(
            beyond[0],
            f"{array[beyond[0]]:g} is beyond {most_of(name):g}, the most that such a column holds; {remedy}, "
            "or leave the cell empty if it is missing",
        )
    if kind_of(name) is Kind.INTEGER:
        _whole(array)
    return array


def _number(row: int, cell: float | int | str) -> float:
    try:
        if not isinstance(cell, str) or ("_" not in cell and cell.isascii()):  # float() takes "1_000" and "\u0661"
            return float(cell)
    except (ValueError, TypeError, OverflowError):  # also what Parquet may hold: dates, blobs
        pass
    raise _BadCellError(
        row, f"'{shown(cell)}' is not a number; write it in SI units, or leave the cell empty if it is missing"
    )


def _whole(array: NDArray[np.float64]) -> None:
    with np.errstate(invalid="ignore"):
        odd = np.flatnonzero(~np.isnan(array) & ((np.floor(array) != array) | (np.abs(array) >= _WHOLE_LIMIT))).tolist()
    if odd:
        raise _BadCellError(odd[0], f"{array[odd[0]]} is not a whole number; correct it")


def _table_faults(table: Table, rig: Rig, needed: Sequence[str]) -> Iterator[Fault]:
    """The first row of every kind of fault."""
    for name in needed:
        yield from _first(np.isnan(table[name]), name, "the value is missing (empty or NaN); it is needed in every row")
    if (fault := time_fault(table["t_s"])) is not None:
        yield fault[0], "t_s", fault[1]
    yield from _together(table, POSITION)
    yield from _together(table, ORIENTATION)
    yield from _together(table, SPOTS)
    for needed in ("placement", "first_psd"):
        if SPOTS[0] in table and needed in table:
            lacking = ~np.isnan(table[SPOTS[0]]) & np.isnan(table[needed])
            yield from _first(
                lacking, needed, "the value is missing, though the row has spots; give the placement and first_psd"
            )
    yield from _among(table, "placement", tuple(rig.placements), "a [[placement]] of the rig")
    yield from _among(table, "first_psd", (1, 2), "a detector")
    if rig.targets:
        yield from _target_faults(table, rig)
    for name in table:
        if name.startswith("approach") and joint_of(name) is not None:
            yield from _among(table, name, (-1, 0, 1), "a direction")
    yield from _bar_faults(table, rig)


def _target_faults(table: Table, rig: Rig) -> Iterator[Fault]:
    if TARGET not in table:
        return
    named = table[TARGET]
    yield from _first(named % 1.0 > 0.0, TARGET, "the value is not a whole number; give the id of a [[target]]")
    yield from _among(table, TARGET, tuple(rig.targets), "a [[target]] of the rig")
    if POSITION[0] in table:
        seen = ~np.isnan(table[POSITION[0]])
        lacking = seen & np.isnan(named)
        if lacking.any() and not lacking[seen].all():
            yield from _first(
                lacking, TARGET, "the value is missing, though other positions name theirs; name it here, too"
            )


def _bar_faults(table: Table, rig: Rig) -> Iterator[Fault]:
    if "bar" not in table:
        return
    yield from _among(table, "bar", tuple(rig.bars), "a [[bar]] of the rig")
    ends = table["bar_end"]
    for row in np.flatnonzero(~np.isin(ends, ("", "a", "b"))).tolist()[:1]:
        yield row, "bar_end", f"'{shown(ends[row])}' is no end of a bar; write a or b"
    with_bar, with_end = ~np.isnan(table["bar"]), ends != ""
    yield from _first(with_bar & ~with_end, "bar_end", "the value is missing, though the row names a bar; write a or b")
    yield from _first(with_end & ~with_bar, "bar", "the value is missing, though the row names an end; give the bar")


def _first(faulty: NDArray[np.bool_], column: str, says: str) -> Iterator[Fault]:
    for row in np.flatnonzero(faulty).tolist()[:1]:
        yield row, column, says


def _together(table: Table, group: tuple[str, ...]) -> Iterator[Fault]:
    if group[0] not in table:
        return
    missing = np.stack([np.isnan(table[name]) for name in group])
    some = missing.any(axis=0) & ~missing.all(axis=0)
    for index, name in enumerate(group):
        says = f"the value is missing (empty or NaN), though others of {', '.join(group)} are there; give all or none"
        yield from _first(some & missing[index], name, says)


def _among(table: Table, column: str, known: tuple[int, ...], what: str) -> Iterator[Fault]:
    if column not in table:
        return
    values = table[column]
    for row in np.flatnonzero(~np.isnan(values) & ~np.isin(values, known)).tolist()[:1]:
        choices = shown(", ".join(str(choice) for choice in known)) or "none"
        yield row, column, f"{int(values[row])} is not {what} (known: {choices}); correct it or add it to the rig"
