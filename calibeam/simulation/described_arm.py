"""The arm of a URDF or MJCF file on the arm of a rig: which hinge is which joint, and the motion between the bases.

An axis is a line, at readings of zero. The motion that fits the lines of the file to those of the rig is found by least
squares, from the turn that fits their directions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from acquisition.recording.files import shown
from acquisition.recording.rig import Rig
from calibeam.new_rig.from_mjcf import mjcf_model, urdf_model
from calibeam.new_rig.from_urdf import xml_root
from calibrate.errors import DataError
from calibrate.model.alignment import best_rotation
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values

Floats = NDArray[np.float64]

APART_M = 3e-3  # between axes of one arm: a calibrated arm is closer to its drawing, another arm is not
APART_RAD = 5e-3
LEAN_RAD = 0.2  # of gravity, between two fits of the axes that are equally good
FAR_RAD = 0.1  # between directions: no search brings those of one arm together
STARTS = 8  # turns about axes that are all parallel
MOST_FLIPPED = 10  # joints, of which each may turn the other way


@dataclass(frozen=True, eq=False)
class DescribedArm:
    """`T` (4, 4) from the world of the file to the base of the rig; bodies at readings of zero, in that base."""

    is_urdf: bool
    model: Any
    mujoco: Any
    joints: tuple[int, ...]  # hinges of the arm, from base to flange
    senses: Floats  # (joint,) 1, or -1 where the hinge turns the other way
    frames: Floats  # (joint + 1, 4, 4) B_0 ... B_n of the rig at readings of zero
    T: Floats
    link: tuple[int, ...]  # of each body: number of the last joint in front of it, 0: the base
    centres_m: Floats  # (body, 3)
    axes: Floats  # (body, 3, 3) principal axes of inertia
    still: tuple[str, ...]  # joints that belong to no axis of the arm and are taken to stand at zero

    def name(self, joint: int) -> str:
        return _name(self.mujoco, self.model, self.joints[joint - 1])


def described_arm(path: Path, rig: Rig) -> DescribedArm:
    """DataError naming file, joint, distance and remedy where the file holds no such arm."""
    is_urdf = xml_root(path, "URDF or MJCF file").tag == "robot"
    mujoco, model = (urdf_model if is_urdf else mjcf_model)(path)
    hinges, link = _hinges(mujoco, model, path, rig.n_joints)
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    data.qpos[model.jnt_qposadr[list(hinges)]] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    arm = arm_of(rig)
    frames = arm.frames(start_values(arm.parameters), np.zeros((1, rig.n_joints)))[0]
    wanted = frames[:-1, :3, 3], frames[:-1, :3, 2]
    drawn = data.xanchor[list(hinges)], data.xaxis[list(hinges)]
    T, senses = _fitted(wanted, drawn, np.asarray(model.opt.gravity), np.array(rig.arm.gravity_m_s2))
    _check_fit(path, [_name(mujoco, model, one) for one in hinges], _apart(wanted, drawn, senses, T))
    others = [one for one in range(model.njnt) if one not in hinges]
    return DescribedArm(
        is_urdf,
        model,
        mujoco,
        hinges,
        senses,
        frames,
        T,
        link,
        data.xipos @ T[:3, :3].T + T[:3, 3],
        T[:3, :3] @ data.ximat.reshape(-1, 3, 3),
        tuple(_name(mujoco, model, one) for one in others),
    )


def _hinges(mujoco: Any, model: Any, path: Path, n: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The joints of the way that ends with the n-th hinge, and of each body the last of them in front of it."""
    ways: dict[int, tuple[int, ...]] = {0: ()}
    for body in range(1, model.nbody):  # parents come first
        own = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        ways[body] = (*ways[int(model.body_parentid[body])], *own)
    most = max(len(way) for way in ways.values())
    arms = {way[:n] for way in ways.values() if len(way) >= n}
    if len(arms) != 1:
        count = f"{len(arms)} arms of {n} joints" if arms else f"at most {most} joints in a row"
        raise DataError(
            f"{path}: {count}, and the rig file has one arm of {n}; give a file that holds this arm alone, on its base"
        )
    (hinges,) = arms
    for one in hinges:
        if model.jnt_type[one] != mujoco.mjtJoint.mjJNT_HINGE:
            raise DataError(
                f"{path}: joint {shown(_name(mujoco, model, one))} is no hinge, and a rig file has turning joints "
                "only; give a file that holds the arm alone, on its base"
            )
    return hinges, tuple(len([one for one in ways[body] if one in hinges]) for body in range(model.nbody))


Lines = tuple[Floats, Floats]  # points (line, 3) and unit directions (line, 3)


def _fitted(wanted: Lines, drawn: Lines, drawn_gravity: Floats, gravity: Floats) -> tuple[Floats, Floats]:
    """(4, 4) and the senses, as few of them reversed as fit; of equal fits the one that gravity agrees with."""
    best: tuple[tuple[bool, bool, float], Floats, Floats] | None = None
    for senses in _senses(len(wanted[0])):
        for T in _motions(wanted, drawn, senses):
            far_m, far_rad = _apart(wanted, drawn, senses, T)
            off = float(np.max(far_m / APART_M + far_rad / APART_RAD))
            down = float(np.linalg.norm(np.cross(T[:3, :3] @ drawn_gravity, gravity)))
            leans = bool(T[:3, :3] @ drawn_gravity @ gravity < 0.0) or down > LEAN_RAD * float(gravity @ gravity)
            fits = bool(np.all(far_m < APART_M) and np.all(far_rad < APART_RAD))
            if best is None or (not fits, leans, off if not fits else 0.0) < best[0]:
                best = (not fits, leans, off if not fits else 0.0), T, senses
        if best is not None and best[0][:2] == (False, False):
            break
    if best is None:
        raise ValueError("an arm without joints")
    return best[1], best[2]


def _senses(n: int) -> Iterator[Floats]:
    """All turning as in the rig, then one reversed, then two."""
    for count in range(n + 1 if n <= MOST_FLIPPED else 1):
        for reversed_ones in combinations(range(n), count):
            out = np.ones(n)
            out[list(reversed_ones)] = -1.0
            yield out


def _motions(wanted: Lines, drawn: Lines, senses: Floats) -> Iterator[Floats]:
    """(4, 4) that bring the drawn lines nearest to the wanted ones, from the turn that fits their directions."""
    first = best_rotation(wanted[1], drawn[1] * senses[:, None])
    parallel = bool(np.all(np.linalg.norm(np.cross(wanted[1], wanted[1][0]), axis=1) < APART_RAD))
    for k in range(STARTS if parallel else 1):
        turn = Rotation.from_rotvec(2.0 * np.pi * k / STARTS * wanted[1][0]).as_matrix() @ first
        start = _motion(np.zeros(6), turn)
        far = float(np.max(_apart(wanted, drawn, senses, start)[1]))
        yield _nearest(wanted, drawn, senses, turn) if far < FAR_RAD else start


def _nearest(wanted: Lines, drawn: Lines, senses: Floats, turn: Floats) -> Floats:
    def residual(six: Floats) -> Floats:
        points, along = _moved(drawn, senses, _motion(six, turn))
        return np.concatenate([np.cross(points - wanted[0], wanted[1]), along - wanted[1]], axis=None)

    return _motion(np.asarray(least_squares(residual, np.zeros(6), xtol=1e-12).x), turn)


def _motion(six: Floats, turn: Floats) -> Floats:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_rotvec(six[:3]).as_matrix() @ turn, six[3:]
    return out


def _moved(drawn: Lines, senses: Floats, T: Floats) -> Lines:
    return drawn[0] @ T[:3, :3].T + T[:3, 3], (drawn[1] * senses[:, None]) @ T[:3, :3].T


def _apart(wanted: Lines, drawn: Lines, senses: Floats, T: Floats) -> Lines:
    """(line,) distance in m of a line from the wanted origin, and angle in rad."""
    points, along = _moved(drawn, senses, T)
    away = np.linalg.norm(np.cross(points - wanted[0], along), axis=1)
    sine, cosine = np.linalg.norm(np.cross(along, wanted[1]), axis=1), np.sum(along * wanted[1], axis=1)
    return away, np.arctan2(sine, cosine)


def _check_fit(path: Path, names: Sequence[str], apart: Lines) -> None:
    off = np.maximum(apart[0] / APART_M, apart[1] / APART_RAD)
    worst = int(np.argmax(off))
    if off[worst] >= 1.0:
        raise DataError(
            f"{path}: the axis of joint {shown(names[worst])} is {1e3 * apart[0][worst]:.3g} mm and "
            f"{1e3 * apart[1][worst]:.3g} mrad from joint {worst + 1} of the rig file with all joints at zero, bases "
            f"brought together ({1e3 * APART_M:g} mm and {1e3 * APART_RAD:g} mrad are allowed): give the file of this "
            'arm, with the zeros of its readings (`ref="..."` of a joint in MJCF, theta_offset_rad in the rig file)'
        )


def _name(mujoco: Any, model: Any, joint: int) -> str:
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"number {joint + 1}"
