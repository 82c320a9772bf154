"""An arm as another file draws it, and the text of its rig file."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Joint, Pose

Floats = NDArray[np.float64]

ROUNDING = 1e-13  # m and rad: sines of quarter turns that are meant to be 0
ANY_TURN_RAD = 2.0 * math.pi  # range of a joint that its file does not limit


@dataclass(frozen=True, eq=False)
class DrawnJoint:
    """One turning joint: T in front of its turn about z, its range, and what it carries up to the next joint."""

    T: Floats  # (4, 4)
    lower_rad: float
    upper_rad: float
    mass_kg: float = 0.0
    com_m: Floats | None = None  # (3,) in the frame that turns with the joint


@dataclass(frozen=True, eq=False)
class DrawnArm:
    """T_base_flange = T_1 Rz(q_1) ... T_n Rz(q_n) T_flange."""

    name: str
    joints: tuple[DrawnJoint, ...]
    T_flange: Floats  # (4, 4)
    notes: tuple[str, ...]  # comments of the file: where it comes from, what was assumed


def onto_axis(axis: Floats) -> Floats:
    """(4, 4) shortest turn that brings z onto a unit vector (3,); onto -z it is half a turn about x."""
    out, z = np.eye(4), np.array([0.0, 0.0, 1.0])
    across = np.cross(z, axis)
    sine = float(np.linalg.norm(across))
    if sine < ROUNDING:
        turn = np.zeros(3) if axis[2] > 0.0 else np.array([math.pi, 0.0, 0.0])
    else:
        turn = across / sine * math.atan2(sine, float(axis[2]))
    out[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    return out


def poe_text(arm: DrawnArm) -> str:
    """The rig file, its arm as `local-poe`."""
    joints: list[Joint] = []
    for joint in arm.joints:
        pose = _pose(joint.T)
        known = joint.mass_kg > 0.0
        com = None if joint.com_m is None or not known else _vector(joint.com_m)
        joints.append(
            Joint(
                joint.lower_rad,
                joint.upper_rad,
                origin_m=pose.origin_m,
                rotation_rad=pose.rotation_rad,
                mass_kg=joint.mass_kg if known else None,
                com_m=com,
            )
        )
    return rig_file_text(arm.name, "local-poe", joints, _pose(arm.T_flange), arm.notes)


def rig_file_text(
    name: str,
    model: str,
    joints: Sequence[Joint],
    flange: Pose,
    notes: Sequence[str],
    point_m: Sequence[float] = (0.0, 0.0, 0.0),
) -> str:
    """A rig file with a target on the flange, ready to be adapted."""
    lines = [*(f"# {line}" for note in notes for line in note.splitlines())]
    lines += ["schema = 1", f"name = {_quoted(name)}", "", "[arm]", f'model = "{model}"']
    lines += ["gravity_m_s2 = [0.0, 0.0, -9.81]"]
    for number, joint in enumerate(joints, start=1):
        lines += ["", f"[[arm.joint]]  # {number}", *_keys(joint)]
    if flange != Pose():
        lines += ["", "[arm.flange]", *_keys(flange)]
    lines += [
        "",
        "[tool]",
        f"point_m = {[*point_m]}  # the target in the flange frame: measure it, or run tool-axes",
    ]
    return "\n".join(lines) + "\n"


def _keys(record: Joint | Pose) -> Iterator[str]:
    for key, value in msgspec.structs.asdict(record).items():
        if isinstance(value, tuple):
            yield f"{key} = [{', '.join(repr(float(v)) for v in value)}]"
        elif isinstance(value, float):
            yield f"{key} = {value!r}"


def _quoted(name: str) -> str:
    return msgspec.json.encode(name).decode()  # a JSON string is a basic string of TOML


def _pose(T: Floats) -> Pose:
    return Pose(_vector(T[:3, 3]), _vector(Rotation.from_matrix(T[:3, :3]).as_rotvec()))


def _vector(values: Floats) -> tuple[float, float, float]:
    x, y, z = (0.0 if abs(v) < ROUNDING else v for v in values.tolist())
    return x, y, z
