"""The statements of `--columns`: `HEADINGS [unit] = meaning, ...` as groups of columns.

    --columns "A1..A6 [deg] = q, X Y Z [mm] = position, 'Wire length' [mm] = wire, Remark = unused"

Headings stand in any case, with or without their unit; in quotes where they hold spaces, commas or `=`; `A1..A6` is a
range.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.foreign.column_meanings import (
    OF_SOME_JOINTS,
    OWN_NAME,
    PER_JOINT,
    POSE_MATRIX,
    REMEDY,
    SETS,
    SINGLE,
    TEMPERATURE,
    TIME,
    UNUSED,
    Group,
    bare_meaning,
    common_unit,
    name_of,
    unit_in,
    without_owner,
)
from acquisition.recording.foreign.heading_units import folded, split_heading
from acquisition.recording.foreign.rotations import CONVENTIONS
from acquisition.recording.foreign.sheet import Sheet
from acquisition.recording.samples import ORIENTATION, POSITION, joint_of

_CLAUSE = re.compile(
    r"""\s*(?P<left>(?:'[^']*'|"[^"]*"|\[[^\]]*\]|[^=,'"\[\]])+)=\s*(?P<right>[A-Za-z][A-Za-z0-9_\-]*)\s*(?:,|$)"""
)
_TOKEN = re.compile(r"""(?P<dots>\.\.)|'(?P<one>[^']*)'|"(?P<two>[^"]*)"|(?P<bare>(?:(?!\.\.)[^\s'"])+)|\s+""")
_OF = re.compile(r"(?P<of>[^\s:'\"\[\]]+):\s+(?P<rest>.+)")
_NUMBER_AT_END = re.compile(r"(.*?)(\d+)")


@dataclass(frozen=True)
class Clause:
    """One statement of `--columns`; `of`: the name of the log that it is about, "" for any."""

    of: str
    text: str

    def is_of(self, sheet: Sheet, name: str) -> bool:
        """Whether the table, a log of that name, has all headings of the statement."""
        if self.of:
            return self.of in (name, sheet.name, sheet.path.name, sheet.path.stem)
        try:
            return bool(tuple(_found(sheet, _list_and_unit(self.text.rpartition("=")[0])[0])))
        except SamplesError:
            return False


def clauses(columns: str) -> tuple[Clause, ...]:
    """The statements of a `--columns` text for several logs: `encoders: A1..A6 [deg] = enc` is about one of them.

    SamplesError for a text that cannot be read.
    """
    out: list[Clause] = []
    at = 0
    while columns[at:].strip():
        match = _matched(columns, at)
        at = match.end()
        named = _OF.fullmatch(match["left"].strip())
        left = named["rest"] if named else match["left"].strip()
        out.append(Clause(named["of"] if named else "", f"{left} = {match['right']}"))
    return tuple(out)


def _matched(columns: str, at: int) -> re.Match[str]:
    match = _CLAUSE.match(columns, at)
    if match is None:
        rest = shown(columns[at:].strip(), 60)
        raise SamplesError(f"--columns: '{rest}' is no `HEADINGS [unit] = meaning`; {REMEDY}")
    return match


def _list_and_unit(left: str) -> tuple[str, str]:
    """`A1..A6 [deg]` as the list of headings and the unit."""
    left = left.strip()
    if not left.endswith("]"):
        return left, ""
    names, _, unit = left[:-1].rpartition("[")
    return names, unit.strip()


def stated_groups(sheet: Sheet, n_joints: int, columns: str) -> Iterator[Group]:
    """The groups of a `--columns` text."""
    at, taken = 0, set[int]()
    meant: set[str] = set()
    while columns[at:].strip():
        match = _matched(columns, at)
        at = match.end()
        left, unit = _list_and_unit(match["left"])
        group = _group(sheet, match["right"], tuple(_found(sheet, left)), unit)
        if again := taken & set(group.columns):
            raise SamplesError(
                f"--columns: '{shown(sheet.headings[min(again)], 40)}' stands twice; give it one meaning"
            )
        if group.meaning in meant:
            raise SamplesError(f"--columns: '{shown(group.meaning, 40)}' stands twice; give it once")
        taken |= set(group.columns)
        meant |= {group.meaning} - {UNUSED}
        yield _of_joints(sheet, group, n_joints)


def _group(sheet: Sheet, meaning: str, columns: tuple[int, ...], unit: str) -> Group:
    for suffix, ending in (("_rad", "rad"), ("_m", "m"), ("_s", "s"), ("_kg", "kg"), ("_v", "v"), ("_degC", "degC")):
        bare = meaning.removesuffix(suffix)
        known = bare in PER_JOINT or bare in SINGLE or TEMPERATURE.fullmatch(bare)
        if bare != meaning and known and Group(bare, (), "").suffix == ending:
            meaning = bare  # `wire_m`: the name as in samples.csv; the unit of the table is another matter
    alias = {"pose": POSE_MATRIX, "quaternion-wxyz": "quaternion", "time": TIME, "joints": "q"}
    group = Group(alias.get(meaning, meaning), columns, unit, stated=bool(unit))
    if group.meaning == UNUSED:
        return group
    if group.kept:
        _check_own(group)
        return replace(group, unit=unit or unit_in(sheet, columns[0]))
    if unit and not group.suffix:
        raise SamplesError(f"--columns: {meaning} has no unit; leave [{shown(unit, 20)}] out")
    moved = [c for i, c in enumerate(columns) if i % 4 == 3] if group.meaning.endswith(POSE_MATRIX) else columns
    return group if unit else replace(group, unit=common_unit(sheet, moved))


def _check_own(group: Group) -> None:
    """SamplesError for a column of the user's own that is none."""
    if len(group.columns) > 1 or not OWN_NAME.fullmatch(group.meaning):
        several = ", ".join((*PER_JOINT, *SETS, "quaternion-xyzw"))
        raise SamplesError(
            f"--columns: '{shown(group.meaning, 40)}' is no meaning of several columns; there are {several}"
        )
    if joint_of(group.meaning) is not None or without_owner(group.meaning) in (*POSITION, *ORIENTATION):
        raise SamplesError(
            f"--columns: '{group.meaning}' alone is no column of one's own; give all that belong together, such as "
            '"A1..A6 [deg] = q" or "X Y Z [mm] = position"'
        )


def _of_joints(sheet: Sheet, group: Group, n_joints: int) -> Group:
    """The group with the joints that its headings number, where it has fewer columns than the arm has joints.

    SamplesError for a number of columns that the meaning does not have.
    """
    if group.meaning not in OF_SOME_JOINTS or not 0 < len(group.columns) < n_joints:
        _check_count(group, n_joints)
        return group
    ends = [_NUMBER_AT_END.fullmatch(name_of(sheet, column)) for column in group.columns]
    joints = tuple(int(end[2]) for end in ends if end)
    if len(set(joints)) == len(group.columns) and all(0 < joint <= n_joints for joint in joints):
        return replace(group, joints=joints)
    names = ", ".join(shown(sheet.headings[column], 30) for column in group.columns)
    raise SamplesError(
        f"--columns: {group.meaning} of {len(group.columns)} of {n_joints} joints, and the headings ({names}) do not "
        f"end in the numbers of these joints, 1 to {n_joints}; rename them, or give a column for each joint"
    )


def _check_count(group: Group, n_joints: int) -> None:
    bare = bare_meaning(group.meaning)
    wanted = {len(group.columns)} if group.meaning == UNUSED else {1}
    if group.meaning in PER_JOINT:
        wanted = {n_joints}
    elif bare in CONVENTIONS:
        wanted = {CONVENTIONS[bare][1]}
    elif bare == "position":
        wanted = {3}
    elif bare == POSE_MATRIX:
        wanted = {12, 16}
    if len(group.columns) not in wanted:
        count = " or ".join(map(str, sorted(wanted)))
        raise SamplesError(
            f"--columns: {group.meaning} takes {count} columns, {len(group.columns)} are given; correct the list"
        )


def statement(names: Sequence[str], meaning: str) -> str:
    """The option that gives columns of these headings a meaning, as it is typed."""
    first, last = (_NUMBER_AT_END.fullmatch(name) for name in (names[0], names[-1]))
    listed = " ".join(f"'{name}'" if any(c in name for c in " ,=[].:") else name for name in names)
    if first and last and first[1] == last[1] and int(last[2]) - int(first[2]) + 1 == len(names) and "'" not in listed:
        listed = f"{names[0]}..{names[-1]}"
    return f'--columns "{shown(listed, 200)} = {meaning}"'


def _found(sheet: Sheet, left: str) -> Iterator[int]:
    """The columns that a list of headings and ranges names."""
    tokens: list[str] = []
    for match in _TOKEN.finditer(left):
        name = match["dots"] or match["one"] or match["two"] or match["bare"]
        tokens += [name] if name else []
    at = 0
    while at < len(tokens):
        if tokens[at + 1 : at + 2] == [".."] and at + 2 < len(tokens):
            yield from _range(sheet, tokens[at], tokens[at + 2])
            at += 3
        else:
            yield _column(sheet, tokens[at])
            at += 1
    if not tokens:
        raise SamplesError(f"--columns: no heading before '='; {REMEDY}")


def _range(sheet: Sheet, first: str, last: str) -> Iterator[int]:
    one, two = _NUMBER_AT_END.fullmatch(first), _NUMBER_AT_END.fullmatch(last)
    if one and two and one[1] == two[1]:
        if not int(one[2]) <= int(two[2]) < int(one[2]) + len(sheet.headings):
            raise SamplesError(f"--columns: '{shown(f'{first}..{last}', 40)}' is no range; write the lower end first")
        yield from (_column(sheet, f"{one[1]}{number}") for number in range(int(one[2]), int(two[2]) + 1))
        return
    begin, end = _column(sheet, first), _column(sheet, last)
    if end < begin:
        raise SamplesError(f"--columns: '{shown(last, 40)}' stands before '{shown(first, 40)}'; exchange them")
    yield from range(begin, end + 1)


def _column(sheet: Sheet, name: str) -> int:
    ways: tuple[Callable[[int], str], ...] = (
        lambda c: sheet.headings[c],
        lambda c: name_of(sheet, c),
        lambda c: folded(name_of(sheet, c)),
    )
    for way in ways:
        wanted = folded(name) if way is ways[-1] else name
        found = [c for c in range(len(sheet.headings)) if way(c) == wanted]
        if len(found) > 1:
            raise SamplesError(
                f"--columns: '{shown(name, 40)}' names {len(found)} columns of {sheet.place()}; rename one"
            )
        if found:
            return found[0]
    aliases = [folded(split_heading(alias)[0]) for alias in sheet.aliases]
    if folded(split_heading(name)[0]) in aliases:
        return aliases.index(folded(split_heading(name)[0]))
    there = ", ".join(filter(None, sheet.headings))
    raise SamplesError(f"--columns: {sheet.place()} has no column '{shown(name, 40)}'; there are {shown(there)}")
