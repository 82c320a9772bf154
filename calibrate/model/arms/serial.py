"""What all serial arms of turning joints have in common: fixed parts and turns about z in alternation.

T_base_flange = F_0 Rz(a_1) F_1 Rz(a_2) ... Rz(a_n) F_n,  a_i = q_i + offset_i; where joint i follows joint k of the
controller, a_i = q_i + by q_k + offset_i (arms/coupled_readings.py).
Every parameter moves one frame B_i = F_0 Rz(a_1) ... F_i, and moves it by a twist that is constant in that frame;
the base sees it through the adjoint of B_i. Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic
Manipulation, 1994, ch. 3.4 (body and spatial manipulator Jacobian).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from calibrate.model.arms import compiled
from calibrate.model.arms.coupled_readings import by_readings, uncoupled
from calibrate.model.chain import KinematicModel
from calibrate.model.parameters import Parameter
from calibrate.model.rigid import cross_matrix, turn_twist

Floats = NDArray[np.float64]


class SerialArm(ABC):
    """KinematicModel of a chain; a kind of arm states what its parameters do to fixed parts and joint offsets."""

    def __init__(self, n_joints: int, parameters: tuple[Parameter, ...], moves_frame: tuple[int, ...]) -> None:
        """`moves_frame`: for each parameter the i of the frame B_i in which its twist is constant, in rising order."""
        self.n_joints = n_joints
        self.parameters = parameters
        self.moves_frame = moves_frame
        self.by_reading: Floats | None = None  # (joint, joint) of coupled readings; None: angles from the links
        self._columns_of = [slice(*ends) for ends in pairwise(np.searchsorted(moves_frame, range(n_joints + 2)))]
        self.latest: tuple[tuple[bytes, bytes] | None, Floats] = None, np.empty(0)  # of `frames`: asked, answered

    @abstractmethod
    def fixed_parts(self, theta: Floats) -> Floats:
        """(joint + 1, 4, 4) F_0 ... F_n."""

    @abstractmethod
    def angle_offset_rad(self, theta: Floats) -> Floats:
        """(joint,) what is added to a joint reading."""

    @abstractmethod
    def body_twists(self, theta: Floats) -> Floats:
        """(param, 6) twist [v; w] by each parameter, written in the frame it moves."""

    def coupled(self, by_reading: Floats | None) -> Self:
        """The same arm, with coupled readings: angle = by_reading @ reading + offset (arms/coupled_readings.py)."""
        out = copy(self)
        out.by_reading, out.latest = by_reading, (None, np.empty(0))
        return out

    def angles_rad(self, theta: Floats, q_rad: Floats, more_rad: Floats | float = 0.0) -> Floats:
        """(pose, joint) turns of the joints at readings (pose, joint); `more_rad` is added behind the coupling."""
        return uncoupled(self.by_reading, q_rad) + more_rad + self.angle_offset_rad(theta)

    def frames(self, theta: Floats, q_rad: Floats) -> Floats:
        """(pose, joint + 1, 4, 4) B_0 ... B_n: joint i turns about z of B_(i-1), B_n is the flange. To be read only."""
        asked, (known, out) = (theta.tobytes(), q_rad.tobytes()), self.latest
        if known != asked:  # a solver wants flanges and their derivatives at the same state
            fixed = self.fixed_parts(theta)
            out = chain_frames(fixed[0], fixed[1:], self.angles_rad(theta, q_rad))
            out.flags.writeable = False
            if len(q_rad) < compiled.WORTH_POSES:  # of more poses nothing is kept
                self.latest = asked, out
        return out

    def flange(self, theta: Floats, q_rad: Floats) -> Floats:
        if compiled.worth(len(q_rad)):
            return compiled.flange(compiled.ArmConstants.of(self, theta), q_rad)
        return self.frames(theta, q_rad)[:, -1].copy()

    def joint_twists(self, theta: Floats, q_rad: Floats) -> Floats:
        before = self.frames(theta, q_rad)[:, :-1]
        turns = np.swapaxes(turn_twist(before[..., :3, 2], before[..., :3, 3]), 1, 2)
        return by_readings(self.by_reading, turns)

    def twists(self, theta: Floats, q_rad: Floats) -> Floats:
        if compiled.worth(len(q_rad)):
            return compiled.twists(compiled.ArmConstants.of(self, theta), q_rad)
        return self.twists_at(theta, self.frames(theta, q_rad))

    def twists_at(self, theta: Floats, B: Floats) -> Floats:
        """(pose, 6, param) as `twists`, of frames (pose, joint + 1, 4, 4) that more than theta may have moved."""
        body, out = self.body_twists(theta), np.empty((len(B), 6, len(self.parameters)))
        for i, columns in enumerate(self._columns_of):
            out[:, :, columns] = twists_of(body[columns], B[:, i])
        return out


def twists_of(body: Floats, B: Floats) -> Floats:
    """(pose, 6, param) base twists of what moves with twists `body` (param, 6) in frames (pose, 4, 4)."""
    seen = (B[:, :3, :3].reshape(-1, 3) @ body.reshape(-1, 3).T).reshape(len(B), 3, len(body), 2)
    turns = seen[..., 1]
    return np.concatenate([seen[..., 0] + cross_matrix(B[:, :3, 3]) @ turns, turns], axis=1)


def point_by_parameter(model: KinematicModel, theta: Floats, point_m: Floats, q_rad: Floats) -> tuple[Floats, Floats]:
    """A point (3,) of the flange in the base (pose, 3), and its derivative by the parameters (pose, 3, param)."""
    if isinstance(model, SerialArm) and compiled.worth(len(q_rad)):
        return compiled.point_and_jacobian(compiled.ArmConstants.of(model, theta), point_m, q_rad)
    T, twists = model.flange(theta, q_rad), model.twists(theta, q_rad)
    points = T[:, :3, :3] @ point_m + T[:, :3, 3]
    return points, twists[:, :3] - cross_matrix(points) @ twists[:, 3:]  # v + w x p


def chain_frames(
    base: Floats, parts: Floats, angle_rad: Floats, perturbed: Mapping[int, Floats] | None = None
) -> Floats:
    """(pose, joint + 1, 4, 4) B_0 = base, B_i = B_(i-1) Rz(a_i) F_i, for angles (pose, joint): the forward kinematics.

    `base` (4, 4) or (pose, 4, 4); `parts` (joint, 4, 4); `perturbed`: number of a frame -> (pose, 4, 4) behind it.
    """
    behind = perturbed or {}
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    B = np.empty((len(parts) + 1, len(angle_rad), 4, 4))  # a frame of all poses after the other: in one piece each
    B[0] = base
    for i, part in enumerate(parts):
        if i in behind:
            B[i] = B[i] @ behind[i]
        before, ci, si = B[i], c[:, i, None], s[:, i, None]
        turned = before.copy()
        turned[:, :, 0] = ci * before[:, :, 0] + si * before[:, :, 1]
        turned[:, :, 1] = ci * before[:, :, 1] - si * before[:, :, 0]
        np.matmul(turned.reshape(-1, 4), part, out=B[i + 1].reshape(-1, 4))  # five times faster than a stack
    if len(parts) in behind:
        B[-1] = B[-1] @ behind[len(parts)]
    return np.swapaxes(B, 0, 1)


def rotation_x(angle_rad: ArrayLike) -> Floats:
    """(..., 4, 4) turn about x."""
    return _turn(angle_rad, 1, 2)


def rotation_y(angle_rad: ArrayLike) -> Floats:
    """(..., 4, 4) turn about y."""
    return _turn(angle_rad, 2, 0)


def rotation_z(angle_rad: ArrayLike) -> Floats:
    """(..., 4, 4) turn about z."""
    return _turn(angle_rad, 0, 1)


def shift(x_m: ArrayLike, z_m: ArrayLike) -> Floats:
    """(..., 4, 4) shift along x and z."""
    out = np.broadcast_to(np.eye(4), (*np.shape(x_m), 4, 4)).copy()
    out[..., 0, 3], out[..., 2, 3] = x_m, z_m
    return out


def _turn(angle_rad: ArrayLike, first: int, second: int) -> Floats:
    """Turn that carries axis `first` towards axis `second`."""
    out = np.broadcast_to(np.eye(4), (*np.shape(angle_rad), 4, 4)).copy()
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    out[..., first, first], out[..., first, second] = c, -s
    out[..., second, first], out[..., second, second] = s, c
    return out
