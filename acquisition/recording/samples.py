"""The settled samples of a session as a table: one row per pose, columns named as in the session-folder format.

The first part fixes what the columns mean (session-folder format, version 1), the second is the table itself.
"""

import enum
import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import SamplesError, shown


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
PLANE = "plane"
BAR, BAR_END = "bar", "bar_end"
MEASURED = (*SPOTS, WIRE, *(f"{device}{name}" for device in ("", "camera_") for name in (*POSITION, *ORIENTATION)))
CONTROLLER = tuple(f"controller_{name}" for name in (*POSITION, *ORIENTATION))  # its own pose of its tool in its base
TARGET = "target"  # which [[target]] of the rig a row is of
COMPLETE_PER_JOINT = (("q", "_rad"), ("cmd", "_rad"), ("enc", "_rad"))  # one column for every joint, or none

_INTEGERS = re.compile(r"placement|first_psd|seat|plane|bar|repeat|approach[1-9][0-9]*")
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


Floats = NDArray[np.float64]
Cell = float | int | str | None


@dataclass(frozen=True, eq=False)
class Samples:
    """Settled samples, already checked against the rig.

    A numeric column is float64 (row,), whole numbers too, and NaN is a missing cell. A text column is an array of str
    (row,) in which "" is a missing cell. `t_s` and `q1_rad` ... `qn_rad` are always there and never missing.
    """

    columns: Mapping[str, NDArray[Any]]
    n_joints: int

    def __len__(self) -> int:
        return int(self.columns["t_s"].size)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.columns)

    def column(self, name: str) -> Floats:
        """A numeric column (row,), NaN where missing. SamplesError if there is none of this name."""
        if name not in self.columns or kind_of(name) is Kind.TEXT:
            raise SamplesError(f"no numeric column '{name}' in the samples; there are {shown(', '.join(self.columns))}")
        return self.columns[name]

    def integers(self, name: str, missing: int) -> NDArray[np.int64]:
        """A column of whole numbers (row,); `missing` stands where there is none; all of it if the column is absent."""
        if name not in self.columns:
            return np.full(len(self), missing, dtype=np.int64)
        values = self.column(name)
        return np.where(np.isnan(values), missing, values).astype(np.int64)

    def joints(self, n: int | None = None) -> Floats:
        """Joint angles as reported, (row, n) rad. ValueError if the caller's arm has another number of joints."""
        if n not in (None, self.n_joints):
            raise ValueError(f"samples of an arm of {self.n_joints} joints read as {n}; use the recording's own rig")
        return self._stacked(per_joint("q", "_rad", self.n_joints))

    def commanded(self) -> Floats | None:
        """Joint angles as commanded, (row, n) rad, NaN where missing; None where they were not recorded."""
        return self._stacked_or_none(per_joint("cmd", "_rad", self.n_joints))

    def encoders(self) -> Floats | None:
        """The second set of encoders, (row, n) rad, NaN where missing; None where there is none."""
        return self._stacked_or_none(per_joint("enc", "_rad", self.n_joints))

    def spots(self) -> Floats | None:
        """psd1 x, y, psd2 x, y, (row, 4) m, NaN where missing; None where no detector was recorded."""
        return self._stacked_or_none(SPOTS)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> "Samples":
        """Some of the rows, by mask or by index, in that order."""
        return Samples({name: values[rows] for name, values in self.columns.items()}, self.n_joints)

    def rows(self) -> Iterator[dict[str, Cell]]:
        """Row by row, column name -> value; None is a missing cell, whole numbers are int."""
        cells = [cells_of(name, values) for name, values in self.columns.items()]
        for row in zip(*cells, strict=True):
            yield dict(zip(self.columns, row, strict=True))

    def _stacked(self, names: tuple[str, ...]) -> Floats:
        return np.stack([self.column(name) for name in names], axis=1) if names else np.zeros((len(self), 0))

    def _stacked_or_none(self, names: tuple[str, ...]) -> Floats | None:
        return self._stacked(names) if all(name in self.columns for name in names) else None


def cells_of(name: str, values: NDArray[Any]) -> list[Cell]:
    """A column as plain cells: None where missing, int in a column of whole numbers."""
    kind = kind_of(name)
    if kind is Kind.TEXT:
        return [str(value) or None for value in values]
    if kind is Kind.INTEGER:
        return [None if value != value else int(value) for value in values.tolist()]
    return [None if value != value else value for value in values.tolist()]


def readings_sha256(samples: Samples) -> str:
    """Of the joint angles in their order, hexadecimal; what else is stated of the rows does not count."""
    return hashlib.sha256(np.ascontiguousarray(samples.joints(), dtype="<f8").tobytes()).hexdigest()


def measured_sha256(samples: Samples) -> str | None:
    """Of what was measured at the joint angles, hexadecimal; None where nothing but these was."""
    names = (*MEASURED, *per_joint("enc", "_rad", samples.n_joints))
    found = [np.round(samples.column(name), 9) for name in names if name in samples]
    return hashlib.sha256(np.stack(found).astype("<f8").tobytes()).hexdigest() if found else None
