"""Masses and contact: what the controller reports of them, from the emulated world.

Mass matrix, gravity and Coriolis torques are the world's. The wrench at the tool is static: the weight of what the
flange really carries less that of the payload which the program has stated. What is not imitated: the wrench of
accelerations, of cables and of a contact; an obstacle is felt by the contact functions only, the arm passes through it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simulators.ur.controller_kinematics import IDENTITY, Frame, NominalArm, Pose, Vector, rotate
from simulators.ur.registers import Installation

Floats = NDArray[np.float64]
RATE_STEP_S = 1e-6  # of the difference quotient of the Jacobian: rounding and curvature are both below 1e-8 of it
NO_WRENCH: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Joints(Protocol):
    """What the joint sensors report; each (n,)."""

    @property
    def q_rad(self) -> Floats: ...
    @property
    def qd_rad_s(self) -> Floats: ...
    @property
    def torque_nm(self) -> Floats: ...
    @property
    def temperature_degC(self) -> Floats: ...


class ArmWorld(Protocol):
    """The part of the world that a controller drives and senses."""

    n_joints: int

    @property
    def time_s(self) -> float: ...
    def command(self, q_rad: ArrayLike) -> None: ...
    def joints(self) -> Joints: ...
    def mass_matrix_kg_m2(self, q_rad: ArrayLike) -> Floats: ...
    def load_nm(self, q_rad: ArrayLike, qd_rad_s: ArrayLike) -> Floats: ...
    def T_base_flange(self) -> Floats: ...


@dataclass(frozen=True)
class Carried:
    """What the flange carries, and gravity in the base frame."""

    mass_kg: float = 0.0
    com_m: Vector = (0.0, 0.0, 0.0)  # in the flange frame
    gravity_m_s2: Vector = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class Obstacle:
    """Everything behind a plane, in the base frame. The default is the surface that the arm is mounted on."""

    point_m: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)  # of length 1, away from the obstacle


class Dynamics:
    """Answers about one arm; `obstacle` and `zero` are what others may change."""

    def __init__(self, world: ArmWorld, arm: NominalArm, carried: Carried) -> None:
        self.obstacle = Obstacle()
        self._world, self._arm, self._carried = world, arm, carried
        self._zero: Pose = NO_WRENCH  # of the force sensor, at the flange and in its axes

    def mass_matrix_kg_m2(self, q_rad: Floats) -> Floats:
        """(n, n), without the rotors, as get_mass_matrix() gives it."""
        return self._world.mass_matrix_kg_m2(q_rad)

    def coriolis_nm(self, q_rad: Floats, qd_rad_s: Floats) -> Floats:
        """(n,) torques of Coriolis and centrifugal forces."""
        return self._world.load_nm(q_rad, qd_rad_s) - self._world.load_nm(q_rad, np.zeros_like(qd_rad_s))

    def jacobian_rate(self, q_rad: Floats, qd_rad_s: Floats, T_flange_tool: Frame) -> Floats:
        """(6, n) derivative of the Jacobian in time, by a central difference along the motion."""
        step_rad = RATE_STEP_S * qd_rad_s
        after, _ = self._arm.jacobian((q_rad + step_rad).tolist(), T_flange_tool)
        before, _ = self._arm.jacobian((q_rad - step_rad).tolist(), T_flange_tool)
        return (after - before) / (2.0 * RATE_STEP_S)

    def raw_wrench(self, T_base_flange: Frame) -> Pose:
        """[N, N m] that the sensor feels at the flange, in its axes: the weight of all that hangs on it."""
        carried = self._carried
        return _weight(T_base_flange, carried.mass_kg, carried.com_m, carried.gravity_m_s2)

    def tool_wrench(self, T_base_flange: Frame, T_base_tool: Frame, stated: Installation) -> Pose:
        """[N, N m] at the tool point in the axes of the base, without the weight of the stated payload."""
        felt = _less(self._unstated(T_base_flange, stated), self._zero)
        force, moment = rotate(T_base_flange, felt[:3]), rotate(T_base_flange, felt[3:])
        arm_m = [T_base_tool[9 + i] - T_base_flange[9 + i] for i in range(3)]
        lever = _cross(arm_m, force)
        return (*force, moment[0] - lever[0], moment[1] - lever[1], moment[2] - lever[2])

    def zero_sensor(self, T_base_flange: Frame, stated: Installation) -> None:
        """From now on the present wrench counts as none (URScript, zero_ftsensor)."""
        self._zero = self._unstated(T_base_flange, stated)

    def outer_torque_nm(self, joints: Joints, qdd_rad_s2: Floats, stated: Installation) -> Floats:
        """(n,) joint torques less those that move the arm and the stated payload (URScript, get_joint_torques)."""
        inertia = self._world.mass_matrix_kg_m2(joints.q_rad) @ qdd_rad_s2
        own_nm = inertia + self._world.load_nm(joints.q_rad, joints.qd_rad_s)
        T_base_flange = self._arm.forward(joints.q_rad.tolist())[0]
        felt = self._unstated(T_base_flange, stated)
        wrench = np.array([*rotate(T_base_flange, felt[:3]), *rotate(T_base_flange, felt[3:])])
        J, _ = self._arm.jacobian(joints.q_rad.tolist(), IDENTITY)
        return joints.torque_nm - own_nm - J.T @ wrench

    def touches(self, T_flange_tool: Frame, direction: Sequence[float]) -> bool:
        """The tool point is in the obstacle, and pushes against it where a `direction` (3,) in the base is given."""
        T_base_flange = self._world.T_base_flange()
        point_m = T_base_flange[:3, :3] @ T_flange_tool[9:] + T_base_flange[:3, 3]
        depth_m = float(np.dot(self.obstacle.normal, np.subtract(self.obstacle.point_m, point_m)))
        against = float(np.dot(self.obstacle.normal, direction)) < 0.0 or not any(direction)
        return depth_m >= 0.0 and against

    def _unstated(self, T_base_flange: Frame, stated: Installation) -> Pose:
        """What hangs on the flange and was not stated, at the flange and in its axes."""
        magnitude = math.hypot(*self._carried.gravity_m_s2)
        length = math.hypot(*stated.gravity_m_s2)
        down = [-magnitude * up / length if length > 0.0 else 0.0 for up in stated.gravity_m_s2]
        own = _weight(T_base_flange, stated.payload_kg, stated.payload_cog_m, down)
        return _less(self.raw_wrench(T_base_flange), own)


def _weight(T_base_flange: Frame, mass_kg: float, com_m: Sequence[float], gravity_m_s2: Sequence[float]) -> Pose:
    """Force and moment at the flange, in its axes."""
    if mass_kg == 0.0:
        return NO_WRENCH
    g, R = gravity_m_s2, T_base_flange
    force = [mass_kg * (R[3 * i] * g[0] + R[3 * i + 1] * g[1] + R[3 * i + 2] * g[2]) for i in range(3)]
    return (force[0], force[1], force[2], *_cross(com_m, force))


def _less(a: Pose, b: Pose) -> Pose:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5])


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
