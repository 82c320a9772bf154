"""A nominal arm: the nominal numbers of a rig file, and the fixed parts that follow from them.

Three notations, each with its own frames (interchange format, [arm]):
    dh         T_i = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)        Denavit and Hartenberg, J. Appl. Mech. 22 (1955) 215
    mdh        T_i = Rx(alpha) Tx(a) Rz(q + offset) Tz(d)        Craig, "Introduction to Robotics", section 3.4
    local-poe  T_i = T[i-1,i](0) Rz(q)                           Huang Kui et al., equation (1)
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Vector, moved, shifted, turned

Floats = NDArray[np.float64]
Model = Literal["dh", "mdh", "local-poe"]


@dataclass(frozen=True)
class Row:
    """One line of a Denavit-Hartenberg table, in m and rad."""

    a_m: float
    alpha_rad: float
    d_m: float
    theta_offset_rad: float = 0.0


@dataclass(frozen=True)
class Drawing:
    """One arm. `com_m` of each link is in the frame that the rig file's own notation gives to the link."""

    name: str
    model: Model
    rows: tuple[Row, ...]  # dh and mdh
    fixed: tuple[tuple[Vector, Vector], ...]  # local-poe: origin and rotation vector
    flange: tuple[Vector, Vector]
    lower_rad: tuple[float, ...]
    upper_rad: tuple[float, ...]
    mass_kg: tuple[float, ...]  # empty: the rig file gives none
    com_m: tuple[Vector, ...]
    gear_ratio: tuple[float, ...]  # empty: an arm without drives
    reach_m: float

    @property
    def n_joints(self) -> int:
        return len(self.lower_rad)


def fixed_parts(drawing: Drawing) -> Floats:
    """(n + 1, 4, 4): T_base_flange(q) = F0 Rz(q1) F1 Rz(q2) ... Rz(qn) Fn."""
    flange = moved(*drawing.flange)
    if drawing.model == "local-poe":
        return np.stack([*(moved(*part) for part in drawing.fixed), flange])
    before: list[Floats] = []
    open_end = np.eye(4)
    for row in drawing.rows:
        offset = turned((0.0, 0.0, row.theta_offset_rad))
        if drawing.model == "dh":
            before.append(open_end @ offset)
            open_end = shifted((row.a_m, 0.0, row.d_m)) @ turned((row.alpha_rad, 0.0, 0.0))
        else:
            before.append(open_end @ turned((row.alpha_rad, 0.0, 0.0)) @ shifted((row.a_m, 0.0, 0.0)) @ offset)
            open_end = shifted((0.0, 0.0, row.d_m))
    return np.stack([*before, open_end @ flange])


def turning_com_m(drawing: Drawing) -> Floats:
    """(n, 3) centres of mass in the frames that turn with the joints, before d, a and alpha are gone along."""
    com_m = np.asarray(drawing.com_m, dtype=np.float64).reshape(-1, 3)
    if drawing.model == "local-poe":
        return com_m
    ends = [
        shifted((row.a_m, 0.0, row.d_m)) @ turned((row.alpha_rad, 0.0, 0.0))
        if drawing.model == "dh"
        else shifted((0.0, 0.0, row.d_m))
        for row in drawing.rows
    ]
    return np.stack([end[:3, :3] @ com + end[:3, 3] for end, com in zip(ends, com_m, strict=True)])


def as_local_poe(drawing: Drawing) -> Drawing:
    """The same arm in the notation that can describe everything."""
    parts = fixed_parts(drawing)
    return Drawing(
        name=drawing.name,
        model="local-poe",
        rows=(),
        fixed=tuple(origin_and_rotation(part) for part in parts[:-1]),
        flange=origin_and_rotation(parts[-1]),
        lower_rad=drawing.lower_rad,
        upper_rad=drawing.upper_rad,
        mass_kg=drawing.mass_kg,
        com_m=tuple((float(x), float(y), float(z)) for x, y, z in turning_com_m(drawing)) if drawing.mass_kg else (),
        gear_ratio=drawing.gear_ratio,
        reach_m=drawing.reach_m,
    )


def origin_and_rotation(pose: Floats) -> tuple[Vector, Vector]:
    """A frame (4, 4) as origin (m) and rotation vector (rad)."""
    x, y, z = (float(value) for value in pose[:3, 3])
    rx, ry, rz = (float(value) for value in Rotation.from_matrix(pose[:3, :3]).as_rotvec())
    return (x, y, z), (rx, ry, rz)
