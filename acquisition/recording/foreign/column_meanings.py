"""What columns of a foreign table may mean: the groups of columns, and the headings that show them.

A meaning is one of several columns (PER_JOINT, SETS, rotations), a column of samples.csv without its unit (SINGLE),
`unused`, or the name of a column of its own, which is kept as it stands.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.explain import suffix_of
from acquisition.recording.foreign.heading_units import split_heading, unit_of
from acquisition.recording.foreign.rotations import CONVENTIONS
from acquisition.recording.foreign.sheet import Sheet
from acquisition.recording.samples import ORIENTATION, POSITION, TARGET, per_joint

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
READ = ("wire", *(f"psd{k}_{axis}" for k in (1, 2) for axis in "xy"))  # by an instrument
TOUCHED = ("seat", "plane", "bar", "sphere")
COMPARED = ("cmd", "enc", "tau", "motor_tau")  # with what the joints report
TEMPERATURE = re.compile(r"temp_([A-Za-z0-9_]+)")
OWN_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def bare_meaning(meaning: str) -> str:
    """Without whose pose it is."""
    return meaning.removeprefix(CAMERA).removeprefix(CONTROLLER)


def without_owner(column: str) -> str:
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
        if TEMPERATURE.fullmatch(self.meaning) or self.meaning.endswith("_degC"):
            return "degC"
        return "" if self.meaning == UNUSED else suffix_of(self.meaning) or ""

    @property
    def measures(self) -> bool:
        """Whether it is what an instrument reads, or which seat, plane, bar or sphere is touched; or a command."""
        bare = bare_meaning(self.meaning)
        return bare in (*CONVENTIONS, "position", POSE_MATRIX) or self.meaning in (*READ, *TOUCHED, *COMPARED)

    @property
    def is_temperature(self) -> bool:
        """Whether it is a temperature, of whatever part."""
        return TEMPERATURE.fullmatch(self.meaning) is not None

    @property
    def kept(self) -> bool:
        """Whether it is a column of the user's own, kept as it stands."""
        bare = bare_meaning(self.meaning)
        known = bare in (*CONVENTIONS, "position", POSE_MATRIX) or self.meaning in (*PER_JOINT, *SINGLE)
        return not known and not TEMPERATURE.fullmatch(self.meaning)

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
        return (f"{self.meaning}_degC",) if TEMPERATURE.fullmatch(self.meaning) else (self.meaning,)


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
# Universal Robots' own names, which their driver does not send in this order: ur_description, urdf/ur_macro.xacro
UR_JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
OF_SOME_JOINTS = ("enc", "tau", "motor_tau")  # not every joint need have a second encoder, or a torque
# folded headings of one column a joint, the number cut off
STEMS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "q": (
            *("q", "j", "a", "joint", "jt", "axis", "achse", "axe", "theta", "θ", "actualq"),
            *("jointpos", "jointangle", "jointposition", "jointpositions", "jointangles"),
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
OF_INTERFACES: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(("actualq", "targetq"), "rad"),
        "actualqd": "rad/s",
        "actualtcppose0": "m",
        "actualtcppose3": "rad",
        **dict.fromkeys(("rax", "robax", "e6axisa", "$axisacta", "axisacta"), "deg"),
    }
)
# folded headings of what has a fixed number of columns; each tuple is one way to write it
SETS: Mapping[str, tuple[tuple[str, ...], ...]] = MappingProxyType(
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
LAST_ROW = tuple(tuple(f"{s}4{j}" for j in (1, 2, 3, 4)) for s in "mth")
# further folded headings of columns that stand alone
ALSO: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {TARGET: ("targetid", "targetno", "reflector", "reflectorid", "reflectorno")}
)
TIMES = ("t", "time", "timestamp", "zeit", "host")
ORIENTATIONS = ("abc", "wpr", "rotvec", "quaternion", "matrix")


def name_of(sheet: Sheet, column: int) -> str:
    """The heading without its unit."""
    return split_heading(sheet.headings[column])[0]


def unit_in(sheet: Sheet, column: int) -> str:
    """The unit of a column, of its heading or the row below; "" where none stands."""
    return split_heading(sheet.headings[column])[1] or sheet.unit_row[column].strip()


def last_number(name: str) -> int | None:
    """The last number in a name; None where there is none."""
    numbers = re.findall(r"\d+", name)
    return int(numbers[-1]) if numbers else None


def common_unit(sheet: Sheet, columns: Sequence[int]) -> str:
    """The unit of columns that belong together. SamplesError where they have several."""
    units = {column: unit_in(sheet, column) for column in columns}
    different = list(dict.fromkeys(units.values()))
    if len({unit_of(unit) or unit for unit in different}) > 1:
        names = ", ".join(f"{shown(sheet.headings[c], 30)}: {shown(u, 20) or 'none'}" for c, u in units.items())
        raise SamplesError(f"{sheet.place()}: columns of one quantity in several units ({names}); use one unit")
    return next((unit for unit in different if unit), "")
