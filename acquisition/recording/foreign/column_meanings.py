"""What the columns of a foreign table mean: by their headings, and by what `--columns` states.

    --columns "A1..A6 [deg] = q, X Y Z [mm] = position, 'Wire length' [mm] = wire, Remark = unused"

Headings stand in any case, with or without their unit; in quotes where they hold spaces, commas or `=`; `A1..A6` is a
range. A meaning is one of GROUPS (several columns), a column of samples.csv without its unit (one), `unused`, or the
name of a column of its own, which is kept as it stands. Nothing is taken twice, and nothing is guessed among several
columns that might be meant.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.explain import suffix_of
from acquisition.recording.foreign.heading_units import folded, split_heading, unit_of
from acquisition.recording.foreign.rotations import CONVENTIONS
from acquisition.recording.foreign.sheet import Sheet
from acquisition.recording.samples import ORIENTATION, POSITION, TARGET, joint_of, per_joint

UNUSED, TIME, POSE_MATRIX = "unused", "t", "pose-matrix"
CAMERA, CONTROLLER = "camera-", "controller-"  # whose pose it is; none: that of the instrument
REMEDY = 'state it: --columns "A1..A6 [deg] = q, X Y Z [mm] = position"'

# columns of samples.csv that stand alone: name without unit -> name, unit of SI ("" for none)
SINGLE: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "t": ("t_s", "s"),
        "wire": ("wire_m", "m"),
        "payload": ("payload_kg", "kg"),
        **{f"payload_com_{axis}": (f"payload_com_{axis}_m", "m") for axis in "xyz"},
        **{f"psd{k}_{axis}": (f"psd{k}_{axis}_m", "m") for k in (1, 2) for axis in "xy"},
        **{f"psd{k}_sum": (f"psd{k}_sum_v", "v") for k in (1, 2)},
        **{
            name: (name, "")
            for name in (
                "placement",
                "first_psd",
                "seat",
                "plane",
                "bar",
                "bar_end",
                "sphere",
                "series",
                "repeat",
                "target",
            )
        },
    }
)
TEXT = ("bar_end",)
_TEMPERATURE = re.compile(r"temp_([A-Za-z0-9_]+)")
_OWN_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def bare_meaning(meaning: str) -> str:
    """Without whose pose it is."""
    return meaning.removeprefix(CAMERA).removeprefix(CONTROLLER)


def _without_owner(column: str) -> str:
    return column.removeprefix("camera_").removeprefix("controller_")


def prefix_of(meaning: str) -> str:
    """Of the columns of samples.csv: "camera_", "controller_", or none."""
    return next((owner.replace("-", "_") for owner in (CAMERA, CONTROLLER) if meaning.startswith(owner)), "")


@dataclass(frozen=True)
class Group:
    """Columns that mean one thing: `columns` are places in the sheet, in the order of the meaning.

    `unit` is as written, "" where none stands and one is needed; `stated`: by a person, and not questioned.
    """

    meaning: str
    columns: tuple[int, ...]
    unit: str
    stated: bool = False
    joints: tuple[int, ...] = ()  # from 1, where only some joints have a column; else all have one

    @property
    def suffix(self) -> str:
        """Of the SI unit that is needed: "rad", "m", ...; "" for what has no unit."""
        if self.meaning in PER_JOINT:
            return PER_JOINT[self.meaning][1].strip("_")
        bare = bare_meaning(self.meaning)
        if bare in ("position", POSE_MATRIX):
            return "m"
        if bare in CONVENTIONS:
            return "rad" if CONVENTIONS[bare][1] == 3 else ""
        if self.meaning in SINGLE:
            return SINGLE[self.meaning][1]
        if _TEMPERATURE.fullmatch(self.meaning) or self.meaning.endswith("_degC"):
            return "degC"
        return "" if self.meaning == UNUSED else suffix_of(self.meaning) or ""

    @property
    def kept(self) -> bool:
        """Whether it is a column of the user's own, kept as it stands."""
        bare = bare_meaning(self.meaning)
        known = bare in (*CONVENTIONS, "position", POSE_MATRIX) or self.meaning in (*PER_JOINT, *SINGLE)
        return not known and not _TEMPERATURE.fullmatch(self.meaning)

    def targets(self, n_joints: int) -> tuple[str, ...]:
        """The columns of samples.csv that come of it."""
        if self.meaning in PER_JOINT:
            of_all = per_joint(*PER_JOINT[self.meaning], n_joints)
            return tuple(of_all[joint - 1] for joint in self.joints) if self.joints else of_all
        bare = bare_meaning(self.meaning)
        prefix = prefix_of(self.meaning)
        if bare in CONVENTIONS:
            return tuple(prefix + name for name in ORIENTATION)
        if bare == "position":
            return tuple(prefix + name for name in POSITION)
        if bare == POSE_MATRIX:
            return tuple(prefix + name for name in (*POSITION, *ORIENTATION))
        if self.meaning in SINGLE:
            return (SINGLE[self.meaning][0],)
        return (f"{self.meaning}_degC",) if _TEMPERATURE.fullmatch(self.meaning) else (self.meaning,)


# meaning -> stem and ending in samples.csv, of one column a joint
PER_JOINT: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "q": ("q", "_rad"),
        "cmd": ("cmd", "_rad"),
        "enc": ("enc", "_rad"),
        "qd": ("qd", "_rad_s"),
        "tau": ("tau", "_nm"),
        "motor_tau": ("motor_tau", "_nm"),
        "approach": ("approach", ""),
        "last_move": ("last_move", "_rad"),
    }
)
OF_SOME_JOINTS = ("enc", "tau", "motor_tau")  # not every joint need have a second encoder, or a torque
# folded headings of one column a joint, the number cut off
_STEMS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "q": (
            *("q", "j", "a", "joint", "jt", "axis", "achse", "axe", "theta", "θ", "actualq", "jointpos", "jointangle"),
            *("rax", "robax", "e6axisa", "axisa", "$axisacta", "axisacta"),
        ),
        "cmd": ("cmd", "command", "qcmd", "targetq", "qtarget", "soll", "cmdq"),
        "enc": ("enc", "encoder"),
        "qd": ("qd", "actualqd", "jointvel"),
        "tau": ("tau",),
        "motor_tau": ("motortau",),
        "approach": ("approach",),
        "last_move": ("lastmove",),
    }
)
# units of names that belong to one interface, by its manual: RTDE (Universal Robots), jointtarget (RAPID), E6AXIS (KRL)
_OF_INTERFACES: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(("actualq", "targetq"), "rad"),
        "actualqd": "rad/s",
        "actualtcppose0": "m",
        "actualtcppose3": "rad",
        **dict.fromkeys(("rax", "robax", "e6axisa", "$axisacta", "axisacta"), "deg"),
    }
)
# folded headings of what has a fixed number of columns; each tuple is one way to write it
_SETS: Mapping[str, tuple[tuple[str, ...], ...]] = MappingProxyType(
    {
        "position": (
            *(tuple(p + axis for axis in "xyz") for p in ("", "t", "p", "pos", "position", "tracker", "smr")),
            *(tuple(axis + p for axis in "xyz") for p in ("pos", "tracker", "smr")),
        ),
        "camera-position": (("camerax", "cameray", "cameraz"),),
        "abc": (("a", "b", "c"),),
        "wpr": (("w", "p", "r"),),
        "rotvec": (("rx", "ry", "rz"),),
        "camera-rotvec": (("camerarx", "camerary", "camerarz"),),
        "controller-position": (("actualtcppose0", "actualtcppose1", "actualtcppose2"),),
        "controller-rotvec": (("actualtcppose3", "actualtcppose4", "actualtcppose5"),),
        "quaternion": (("qw", "qx", "qy", "qz"), ("quatw", "quatx", "quaty", "quatz"), ("q1", "q2", "q3", "q4")),
        "matrix": tuple(tuple(f"{s}{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)) for s in "rmth"),
        POSE_MATRIX: tuple(tuple(f"{s}{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3, 4)) for s in "mth"),
    }
)
_LAST_ROW = tuple(tuple(f"{s}4{j}" for j in (1, 2, 3, 4)) for s in "mth")
# further folded headings of columns that stand alone
_ALSO: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {TARGET: ("targetid", "targetno", "reflector", "reflectorid", "reflectorno")}
)
_TIMES = ("t", "time", "timestamp", "zeit", "host")
_ORIENTATIONS = ("abc", "wpr", "rotvec", "quaternion", "matrix")


def understood(sheet: Sheet, n_joints: int, columns: str = "", *, with_arm: bool = True) -> tuple[Group, ...]:
    """Which columns mean what: as `columns` states, and for the rest by the headings.

    Without an arm `n_joints` counts the encoders, and their angles are the only columns of one a joint.
    SamplesError for a statement that cannot be read or found, and where several columns might be meant.
    """
    stated = tuple(_stated(sheet, n_joints, columns))
    per_joint_meanings = tuple(PER_JOINT) if with_arm else ("enc",)
    if wrong := next((g for g in stated if g.meaning in PER_JOINT and g.meaning not in per_joint_meanings), None):
        raise SamplesError(f"--columns: {wrong.meaning} needs an arm, and the rig file has none; state enc")
    return (*stated, *_Headings(sheet, n_joints, stated).groups(per_joint_meanings))


def name_of(sheet: Sheet, column: int) -> str:
    """The heading without its unit."""
    return split_heading(sheet.headings[column])[0]


def unit_in(sheet: Sheet, column: int) -> str:
    """The unit of a column, of its heading or the row below; "" where none stands."""
    return split_heading(sheet.headings[column])[1] or sheet.unit_row[column].strip()


def common_unit(sheet: Sheet, columns: Sequence[int]) -> str:
    """The unit of columns that belong together. SamplesError where they have several."""
    units = {column: unit_in(sheet, column) for column in columns}
    different = list(dict.fromkeys(units.values()))
    if len({unit_of(unit) or unit for unit in different}) > 1:
        names = ", ".join(f"{shown(sheet.headings[c], 30)}: {shown(u, 20) or 'none'}" for c, u in units.items())
        raise SamplesError(f"{sheet.place()}: columns of one quantity in several units ({names}); use one unit")
    return next((unit for unit in different if unit), "")


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
        for group in self._single((TIME,), lambda _: _TIMES):
            yield replace(group, unit="s") if of_rtde and not group.unit else group
        for meaning in per_joint_meanings:
            yield from self._per_joint(meaning)
        yield from self._sets()
        names = [name for name in SINGLE if name != TIME]
        yield from self._single(names, lambda name: (folded(name), *_ALSO.get(name, ())))
        for column in [c for columns in self._free.values() for c in columns]:
            match = _TEMPERATURE.fullmatch(name_of(self._sheet, column))
            if match and match[0] not in self._meant:
                yield self._taken(match[0], (column,))

    def _per_joint(self, meaning: str) -> Iterator[Group]:
        if meaning in self._meant:
            return
        found = {stem: self._numbered(stem) for stem in _STEMS[meaning]}
        whole = {stem: columns for stem, columns in found.items() if len(columns) == self._n}
        if len(whole) > 1:
            names = " or ".join(self._names(columns) for columns in whole.values())
            differ = self._differ(*list(whole.values())[:2])
            raise SamplesError(f"{self._sheet.place()}: {meaning} may be {names}{differ}; {self._remedy(meaning)}")
        if whole:
            ((stem, columns),) = whole.items()
            yield self._taken(meaning, columns, stem)
        elif meaning == "q" and (most := max(found.values(), key=len)):
            raise SamplesError(
                f"{self._sheet.place()}: {len(most)} joint angles ({self._names(most)}) for an arm of {self._n} "
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

    def _sets(self) -> Iterator[Group]:
        for meaning, ways in _SETS.items():
            bare = bare_meaning(meaning)
            prefix = meaning.removesuffix(bare)
            rivals = {prefix + other for other in _ORIENTATIONS} if bare in _ORIENTATIONS else {meaning}
            if bare == POSE_MATRIX:
                rivals |= {"position", *_ORIENTATIONS}
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
            for name in (name for way in _LAST_ROW for name in way):
                self._free.pop(name, None)
            moved = [c for i, c in enumerate(columns) if i % 4 == 3]
            return Group(meaning, columns, common_unit(self._sheet, moved))
        return Group(meaning, columns, common_unit(self._sheet, columns) or _OF_INTERFACES.get(name, ""))

    def _names(self, columns: Sequence[int]) -> str:
        names = [shown(self._sheet.headings[c], 30) for c in columns]
        return ", ".join(names) if len(names) < 4 else f"{names[0]} … {names[-1]}"

    def _remedy(self, meaning: str) -> str:
        return f'state which: --columns "… = {meaning}"'


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


def _stated(sheet: Sheet, n_joints: int, columns: str) -> Iterator[Group]:
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
        known = bare in PER_JOINT or bare in SINGLE or _TEMPERATURE.fullmatch(bare)
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
    if len(group.columns) > 1 or not _OWN_NAME.fullmatch(group.meaning):
        several = ", ".join((*PER_JOINT, *_SETS, "quaternion-xyzw"))
        raise SamplesError(
            f"--columns: '{shown(group.meaning, 40)}' is no meaning of several columns; there are {several}"
        )
    if joint_of(group.meaning) is not None or _without_owner(group.meaning) in (*POSITION, *ORIENTATION):
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
    there = ", ".join(filter(None, sheet.headings))
    raise SamplesError(f"--columns: {sheet.place()} has no column '{shown(name, 40)}'; there are {shown(there)}")
