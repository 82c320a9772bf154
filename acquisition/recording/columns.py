"""Which columns of a table of settled samples mean what: the names of the session-folder format, version 1."""

import enum
import re


class Kind(enum.Enum):
    """What the cells of a column are."""

    NUMBER = "number"
    INTEGER = "integer"
    TEXT = "text"


SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
POSITION = ("x_m", "y_m", "z_m")
ORIENTATION = ("rx_rad", "ry_rad", "rz_rad")  # beside a position: a full pose
WIRE = "wire_m"
SEAT = "seat"
BAR, BAR_END = "bar", "bar_end"
COMPLETE_PER_JOINT = (("q", "_rad"), ("cmd", "_rad"), ("enc", "_rad"))  # one column for every joint, or none

_INTEGERS = re.compile(r"placement|first_psd|seat|bar|repeat|approach[1-9][0-9]*")
_PER_JOINT = re.compile(r"(?P<stem>q|cmd|enc|approach|qd|last_move)(?P<joint>[0-9]{1,4})(?P<unit>_rad_s|_rad|)")
_UNITS = {"q": "_rad", "cmd": "_rad", "enc": "_rad", "qd": "_rad_s", "approach": "", "last_move": "_rad"}


def kind_of(column: str) -> Kind:
    """What the cells of this column must be; a column that the format does not name holds numbers."""
    if column == "bar_end":
        return Kind.TEXT
    return Kind.INTEGER if _INTEGERS.fullmatch(column) else Kind.NUMBER


def joint_of(column: str) -> int | None:
    """The joint, from 1, that a column such as "q3_rad" or "approach3" speaks of; None for every other column."""
    match = _PER_JOINT.fullmatch(column)
    return int(match["joint"]) if match and _UNITS[match["stem"]] == match["unit"] else None


def per_joint(stem: str, unit: str, n_joints: int) -> tuple[str, ...]:
    """The names of one quantity of every joint: ("q1_rad", ..., "q6_rad")."""
    return tuple(f"{stem}{joint}{unit}" for joint in range(1, n_joints + 1))


def required(n_joints: int) -> tuple[str, ...]:
    """The columns that every table has and in which no cell may be missing."""
    return ("t_s", *per_joint("q", "_rad", n_joints))
