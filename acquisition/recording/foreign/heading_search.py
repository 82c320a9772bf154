"""Which columns of a foreign table mean what: as `--columns` states, and for the rest by their headings.

Nothing is taken twice, and nothing is guessed among several columns that might be meant.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.foreign.column_meanings import (
    ALSO,
    LAST_ROW,
    OF_INTERFACES,
    ORIENTATIONS,
    PER_JOINT,
    POSE_MATRIX,
    REMEDY,
    SETS,
    SINGLE,
    STEMS,
    TEMPERATURE,
    TIME,
    TIMES,
    UNUSED,
    UR_JOINTS,
    Group,
    bare_meaning,
    common_unit,
    last_number,
    name_of,
)
from acquisition.recording.foreign.column_statements import stated_groups, statement
from acquisition.recording.foreign.heading_units import folded
from acquisition.recording.foreign.sheet import Sheet


def understood(sheet: Sheet, n_joints: int, columns: str = "", *, with_arm: bool = True) -> tuple[Group, ...]:
    """Which columns mean what: as `columns` states, and for the rest by the headings.

    Without an arm `n_joints` counts the encoders, and their angles are the only columns of one a joint.
    SamplesError for a statement that cannot be read or found, and where several columns might be meant.
    """
    stated = tuple(stated_groups(sheet, n_joints, columns))
    per_joint_meanings = tuple(PER_JOINT) if with_arm else ("enc",)
    if wrong := next((g for g in stated if g.meaning in PER_JOINT and g.meaning not in per_joint_meanings), None):
        raise SamplesError(f"--columns: {wrong.meaning} needs an arm, and the rig file has none; state enc")
    return (*stated, *_Headings(sheet, n_joints, stated).groups(per_joint_meanings))


_NUMBER = re.compile(r"\d+")


class _Headings:
    """Searches for meanings among the headings that nobody has stated a meaning of."""

    def __init__(self, sheet: Sheet, n_joints: int, stated: Sequence[Group]) -> None:
        self._sheet, self._n, self._stated = sheet, n_joints, stated
        taken = {column for group in stated for column in group.columns}
        self._meant = {group.meaning for group in stated if group.meaning != UNUSED}
        self._free: dict[str, list[int]] = {}
        for column in range(len(sheet.headings)):
            if column not in taken and sheet.headings[column]:
                self._free.setdefault(folded(name_of(sheet, column)), []).append(column)

    def groups(self, per_joint_meanings: Sequence[str]) -> Iterator[Group]:
        of_rtde = any(
            name in self._free for name in ("actualq0", "targetq0", "actualtcppose0")
        )  # its time is in seconds
        for group in self._single((TIME,), lambda _: TIMES):
            yield replace(group, unit="s") if of_rtde and not group.unit else group
        for meaning in per_joint_meanings:
            yield from self._per_joint(meaning)
        yield from self._sets()
        names = [name for name in SINGLE if name != TIME]
        yield from self._single(names, lambda name: (folded(name), *ALSO.get(name, ())))
        for column in [c for columns in self._free.values() for c in columns]:
            match = TEMPERATURE.fullmatch(name_of(self._sheet, column))
            if match and match[0] not in self._meant:
                yield self._taken(match[0], (column,))

    def _per_joint(self, meaning: str) -> Iterator[Group]:
        if meaning in self._meant:
            return
        found = {stem: self._numbered(stem) for stem in STEMS[meaning]}
        whole = {stem: columns for stem, columns in found.items() if len(columns) == self._n}
        if len(whole) > 1:
            names = " or ".join(self._names(columns) for columns in whole.values())
            differ = self._differ(*list(whole.values())[:2])
            raise SamplesError(f"{self._sheet.place()}: {meaning} may be {names}{differ}; {self._remedy(meaning)}")
        if whole:
            ((stem, columns),) = whole.items()
            yield self._taken(meaning, columns, stem)
        elif meaning == "q" and (columns := self._named_joints()):
            yield self._taken(meaning, columns)
        elif meaning == "q" and (most := max(found.values(), key=len)) and not self._of_another_device(most):
            raise self._wrong_count(most)

    def _wrong_count(self, columns: Sequence[int]) -> SamplesError:
        return SamplesError(
            f"{self._sheet.place()}: {len(columns)} joint angles ({self._names(columns)}) for an arm of {self._n} "
            f"joints; correct the table, use another rig file, or {REMEDY}"
        )

    def _differ(self, one: Sequence[int], other: Sequence[int]) -> str:
        """Where two readings of the table part first."""
        for row, cells in enumerate(self._sheet.rows):
            for a, b in zip(one, other, strict=True):
                if cells[a] != cells[b]:
                    names = [shown(self._sheet.headings[c], 30) for c in (a, b)]
                    values = [shown(str(cells[c]), 20) for c in (a, b)]
                    return f" (row {self._sheet.lines[row]}: {names[0]} {values[0]}, {names[1]} {values[1]})"
        return " (all their numbers are the same)"

    def _numbered(self, stem: str) -> tuple[int, ...]:
        """Columns stem1, stem2, ... or, as programmers count, stem0, stem1, ...; up to the first that is not there."""
        first = 0 if f"{stem}0" in self._free else 1
        out: list[int] = []
        while (columns := self._free.get(f"{stem}{first + len(out)}")) is not None:
            out.append(self._only(columns))
        return tuple(out)

    def _of_another_device(self, columns: Sequence[int]) -> bool:
        """Whether they are named joints, fewer than the arm has: those of a gripper or a rail."""
        return len(columns) < self._n and set(columns) <= set(self._sheet.joint_columns)

    def _named_joints(self) -> tuple[int, ...]:
        """The joints of one arm among named joints, in order; empty: none.

        SamplesError for joints of several arms, or of a larger one.
        """
        free = {column for columns in self._free.values() for column in columns}
        names = {c: name_of(self._sheet, c) for c in self._sheet.joint_columns if c in free}
        arms = list(dict.fromkeys((*_arms_of_numbers(names, self._n), *_arms_of_makers(names, self._n))))
        if len(arms) > 1:
            several = " or ".join(f"{names[c[0]]} … {names[c[-1]]}" for c in arms)
            stated = statement([names[column] for column in arms[0]], "q")
            raise SamplesError(f"{self._sheet.place()}: q may be {several}; state which: {stated}")
        if not arms:
            larger = range(self._n + 1, len(names) + 1)
            if found := next((arm for count in larger for arm in _arms_of_numbers(names, count)), None):
                raise self._wrong_count(found)
        return arms[0] if arms else ()

    def _sets(self) -> Iterator[Group]:
        for meaning, ways in SETS.items():
            bare = bare_meaning(meaning)
            prefix = meaning.removesuffix(bare)
            rivals = {prefix + other for other in ORIENTATIONS} if bare in ORIENTATIONS else {meaning}
            if bare == POSE_MATRIX:
                rivals |= {"position", *ORIENTATIONS}
            there = [way for way in ways if all(name in self._free for name in way)]
            if bare == "matrix" and any(f"{way[0][0]}14" in self._free for way in there):
                continue  # the rotation of a whole pose, which comes next
            if self._meant & rivals:
                continue
            if len(there) > 1:
                names = " or ".join(self._names([self._free[name][0] for name in way]) for way in there)
                raise SamplesError(f"{self._sheet.place()}: {meaning} may be {names}; {self._remedy(meaning)}")
            if there:
                yield self._taken(meaning, tuple(self._only(self._free[name]) for name in there[0]), there[0][0])

    def _single(self, names: Sequence[str], headings: Callable[[str], tuple[str, ...]]) -> Iterator[Group]:
        for name in names:
            there = [heading for heading in headings(name) if heading in self._free]
            if name in self._meant or not there:
                continue
            if len(there) > 1:
                both = self._names([self._free[heading][0] for heading in there])
                raise SamplesError(f"{self._sheet.place()}: {name} may be any of {both}; {self._remedy(name)}")
            yield self._taken(name, (self._only(self._free[there[0]]),))

    def _only(self, columns: list[int]) -> int:
        if len(columns) > 1:
            name = shown(self._sheet.headings[columns[1]], 40)
            raise SamplesError(f"{self._sheet.place()}: two columns are named '{name}'; rename one")
        return columns[0]

    def _taken(self, meaning: str, columns: tuple[int, ...], name: str = "") -> Group:
        """`name`: the folded heading, for the unit of an interface where none stands."""
        self._meant.add(meaning)
        for column in columns:
            self._free.pop(folded(name_of(self._sheet, column)), None)
        if meaning == POSE_MATRIX:
            for name in (name for way in LAST_ROW for name in way):
                self._free.pop(name, None)
            moved = [c for i, c in enumerate(columns) if i % 4 == 3]
            return Group(meaning, columns, common_unit(self._sheet, moved))
        return Group(meaning, columns, common_unit(self._sheet, columns) or OF_INTERFACES.get(name, ""))

    def _names(self, columns: Sequence[int]) -> str:
        names = [shown(self._sheet.headings[c], 30) for c in columns]
        return ", ".join(names) if len(names) < 4 else f"{names[0]} … {names[-1]}"

    def _remedy(self, meaning: str) -> str:
        return f'state which: --columns "… = {meaning}"'


def _arms_of_numbers(names: Mapping[int, str], n_joints: int) -> Iterator[tuple[int, ...]]:
    """Columns whose names differ in one number alone, where these are 1 to n, or 0 to n - 1.

    Names that differ in more are an arm where there are no others, and their last numbers are 1 to n.
    """
    last = {last_number(name) or 0: column for column, name in names.items()}
    if len(names) == n_joints and sorted(last) == list(range(1, n_joints + 1)):
        yield tuple(last[number] for number in sorted(last))
    alike: dict[tuple[str, str], dict[int, int]] = {}
    for column, name in names.items():
        for match in _NUMBER.finditer(name):
            alike.setdefault((name[: match.start()], name[match.end() :]), {})[int(match[0])] = column
    for numbered in alike.values():
        if sorted(numbered) in (list(range(1, n_joints + 1)), list(range(n_joints))):
            yield tuple(numbered[number] for number in sorted(numbered))


def _arms_of_makers(names: Mapping[int, str], n_joints: int) -> Iterator[tuple[int, ...]]:
    """Columns of UR_JOINTS with one prefix."""
    columns = {name: column for column, name in names.items()}
    last = UR_JOINTS[-1]
    for prefix in (name.removesuffix(last) for name in columns if name.endswith(last)):
        if n_joints == len(UR_JOINTS) and all(prefix + name in columns for name in UR_JOINTS):
            yield tuple(columns[prefix + name] for name in UR_JOINTS)
