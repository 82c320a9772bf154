"""The arm as the controller believes it: nominal Denavit-Hartenberg chain, its Jacobian and its numeric inverse.

The emulated world is built from other numbers (drawing plus concealed deviations) and by other means: a pose that this
file computes is what a controller *says*, not where the arm is.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.ur.poses import IDENTITY, Frame, Pose, compose, frame_of, twist_to

Floats = NDArray[np.float64]
Axis = tuple[float, float, float, float, float, float]  # direction, then a point on it, in the base frame

NEWTON_STEPS = 60  # from 1 rad away 6..12 are needed; more means that there is no solution near
NEWTON_STEP_RAD = 0.5  # a longer step leaves the region where the Jacobian says anything
DAMPING = 1e-9  # keeps the normal equations solvable at a singularity; bends the answer by less than 1e-9 otherwise


@dataclass(frozen=True)
class Link:
    """One joint and the link after it, standard Denavit-Hartenberg."""

    a_m: float
    alpha_rad: float
    d_m: float
    theta_offset_rad: float


class NominalArm:
    """Pure functions of joint readings; raises nothing for finite input of the right length."""

    def __init__(self, links: Sequence[Link], T_tip_flange: Frame = IDENTITY) -> None:
        self.n_joints = len(links)
        self.a_m, self.d_m = [link.a_m for link in links], [link.d_m for link in links]
        self.alpha_rad = [link.alpha_rad for link in links]
        self.theta_offset_rad = [link.theta_offset_rad for link in links]
        self._links = [
            (link.a_m, math.cos(link.alpha_rad), math.sin(link.alpha_rad), link.d_m, link.theta_offset_rad)
            for link in links
        ]
        self._T_tip_flange = T_tip_flange
        self._tip_is_flange = T_tip_flange == IDENTITY
        self._remembered = lru_cache(maxsize=4)(self._forward)  # actual and target of an arm that stands

    @classmethod
    def from_rig(cls, rig: Mapping[str, Any]) -> "NominalArm":
        """The arm of a rig as `tomllib` gives it. ValueError unless it has six D-H joints, as it drives."""
        arm = rig["arm"]
        if arm["model"] != "dh" or len(arm["joint"]) != 6:
            raise ValueError(
                f'rig file: arm.model = "{arm["model"]}" with {len(arm["joint"])} joints cannot be driven by the '
                'emulated UR controller; it takes model = "dh" and six [[arm.joint]]'
            )
        links = [Link(j["a_m"], j["alpha_rad"], j["d_m"], j.get("theta_offset_rad", 0.0)) for j in arm["joint"]]
        flange = arm.get("flange", {})
        origin = flange.get("origin_m", (0.0, 0.0, 0.0))
        return cls(links, frame_of((*origin, *flange.get("rotation_rad", (0.0, 0.0, 0.0)))))

    def forward(self, q_rad: Sequence[float]) -> tuple[Frame, tuple[Axis, ...]]:
        """T_base_flange and the six joint axes, in the base frame."""
        return self._remembered(tuple(q_rad))

    def _forward(self, q_rad: tuple[float, ...]) -> tuple[Frame, tuple[Axis, ...]]:
        xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz = IDENTITY
        axes: list[Axis] = []
        for (a, ca, sa, d, offset), q in zip(self._links, q_rad, strict=True):
            axes.append((zx, zy, zz, px, py, pz))
            c, s = math.cos(q + offset), math.sin(q + offset)
            ux, uy, uz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz  # y after Rz
            xx, xy, xz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
            px, py, pz = px + a * xx + d * zx, py + a * xy + d * zy, pz + a * xz + d * zz
            yx, yy, yz = ca * ux + sa * zx, ca * uy + sa * zy, ca * uz + sa * zz
            zx, zy, zz = ca * zx - sa * ux, ca * zy - sa * uy, ca * zz - sa * uz
        tip = (xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
        return (tip if self._tip_is_flange else compose(tip, self._T_tip_flange)), tuple(axes)

    def tool(self, q_rad: Sequence[float], T_flange_tool: Frame) -> Frame:
        """T_base_tool."""
        return compose(self.forward(q_rad)[0], T_flange_tool)

    def jacobian(self, q_rad: Sequence[float], T_flange_tool: Frame) -> tuple[Floats, Frame]:
        """(6, n) tool speed [m/s, rad/s] in the base frame per joint speed, and T_base_tool."""
        T_base_flange, axes = self.forward(q_rad)
        T_base_tool = compose(T_base_flange, T_flange_tool)
        columns = [_speed_column(axis, T_base_tool) for axis in axes]
        return np.array(columns).T, T_base_tool

    def inverse(
        self, T_base_tool: Frame, q_near_rad: Sequence[float], T_flange_tool: Frame,
        position_error_m: float = 1e-9, rotation_error_rad: float = 1e-9,
    ) -> Floats | None:  # fmt: skip
        """Joint readings (n,) that reach the pose, near the given ones by damped Newton steps; None if there are none.

        Source of the step: Siciliano et al., "Robotics: Modelling, Planning and Control", section 3.7 (damped inverse).
        """
        q = np.array(q_near_rad, dtype=np.float64)
        for _ in range(NEWTON_STEPS):
            J, now = self.jacobian(q.tolist(), T_flange_tool)
            error = np.array(twist_to(now, T_base_tool))
            if np.abs(error[:3]).max() <= position_error_m and np.abs(error[3:]).max() <= rotation_error_rad:
                return q
            step = np.linalg.solve(J.T @ J + DAMPING * np.eye(self.n_joints), J.T @ error)
            longest = float(np.abs(step).max())
            q += step * min(1.0, NEWTON_STEP_RAD / longest) if longest > 0.0 else 0.0
        return None


def tool_speed(axes: Sequence[Axis], T_base_tool: Frame, qd_rad_s: Sequence[float]) -> Pose:
    """[m/s, rad/s] of the tool point in the base frame: sum of the joints' screws (Siciliano, section 3.1)."""
    vx = vy = vz = wx = wy = wz = 0.0
    for axis, qd in zip(axes, qd_rad_s, strict=True):
        cx, cy, cz, ax, ay, az = _speed_column(axis, T_base_tool)
        vx, vy, vz = vx + cx * qd, vy + cy * qd, vz + cz * qd
        wx, wy, wz = wx + ax * qd, wy + ay * qd, wz + az * qd
    return (vx, vy, vz, wx, wy, wz)


def _speed_column(axis: Axis, T_base_tool: Frame) -> Pose:
    ax, ay, az, px, py, pz = axis
    rx, ry, rz = T_base_tool[9] - px, T_base_tool[10] - py, T_base_tool[11] - pz
    return (ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx, ax, ay, az)
