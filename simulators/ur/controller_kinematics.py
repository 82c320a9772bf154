"""The arm as its controller computes it: nominal Denavit-Hartenberg chain, its Jacobian, its inverse, and poses.

The emulated world is built from other numbers (nominal values plus concealed deviations) and by other means: a pose
that this file computes is what a controller reports, not where the arm is.

A pose is [x, y, z, rx, ry, rz], metres and a rotation vector, in plain floats, because poses run every tick. A `Frame`
holds the columns of a rotation and an origin: (xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz), so that x = R[:, 0] and
so on. Rotation vector and quaternion formulas: Murray, Li, Sastry, "A Mathematical Introduction to Robotic
Manipulation", section 2.2 (Rodrigues); Shepperd, "Quaternion from rotation matrix", 1978.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Frame = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
Pose = tuple[float, float, float, float, float, float]
Vector = tuple[float, float, float]

IDENTITY: Frame = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def rotate(frame: Frame, v: Sequence[float]) -> Vector:
    """R v."""
    a, b, c = v
    return (
        frame[0] * a + frame[3] * b + frame[6] * c,
        frame[1] * a + frame[4] * b + frame[7] * c,
        frame[2] * a + frame[5] * b + frame[8] * c,
    )


def compose(T_a_b: Frame, T_b_c: Frame) -> Frame:
    """T_a_c; what URScript calls pose_trans(p_from, p_from_to)."""
    x = rotate(T_a_b, T_b_c[0:3])
    y = rotate(T_a_b, T_b_c[3:6])
    z = rotate(T_a_b, T_b_c[6:9])
    p = rotate(T_a_b, T_b_c[9:12])
    return (*x, *y, *z, p[0] + T_a_b[9], p[1] + T_a_b[10], p[2] + T_a_b[11])


def invert(T_a_b: Frame) -> Frame:
    """T_b_a."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz = T_a_b
    return (
        *(xx, yx, zx, xy, yy, zy, xz, yz, zz),
        -(xx * px + xy * py + xz * pz),
        -(yx * px + yy * py + yz * pz),
        -(zx * px + zy * py + zz * pz),
    )


def frame_of(pose: Sequence[float]) -> Frame:
    """The frame of a pose [x, y, z, rx, ry, rz]."""
    x, y, z, rx, ry, rz = pose
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    if angle < 1e-12:  # sin(a)/a and (1 - cos(a))/a^2 at zero
        s, k = 1.0, 0.5
    else:
        s, k = math.sin(angle) / angle, (1.0 - math.cos(angle)) / (angle * angle)
    c = math.cos(angle)
    return (
        *(c + k * rx * rx, k * rx * ry + s * rz, k * rx * rz - s * ry),
        *(k * rx * ry - s * rz, c + k * ry * ry, k * ry * rz + s * rx),
        *(k * rx * rz + s * ry, k * ry * rz - s * rx, c + k * rz * rz),
        *(x, y, z),
    )


def rotation_vector(frame: Frame) -> Vector:
    """Rotation vector of length 0..pi, by the largest quaternion component, so that it is exact near 0 and near pi."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = frame[:9]
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        w, i, j, k = 1.0 + trace, yz - zy, zx - xz, xy - yx
    elif largest == xx:
        w, i, j, k = yz - zy, 1.0 + xx - yy - zz, xy + yx, zx + xz
    elif largest == yy:
        w, i, j, k = zx - xz, xy + yx, 1.0 + yy - xx - zz, yz + zy
    else:
        w, i, j, k = xy - yx, zx + xz, yz + zy, 1.0 + zz - xx - yy
    length = math.sqrt(i * i + j * j + k * k)
    if length < 1e-300:
        return (0.0, 0.0, 0.0)
    if w < 0.0:
        w, i, j, k = -w, -i, -j, -k
    scale = 2.0 * math.atan2(length, w) / length
    return (i * scale, j * scale, k * scale)


def pose_of(frame: Frame) -> Pose:
    """[x, y, z, rx, ry, rz] of a frame."""
    return (frame[9], frame[10], frame[11], *rotation_vector(frame))


def twist_to(T_base_from: Frame, T_base_to: Frame) -> Pose:
    """Shift of the origin and rotation vector, both in the base frame, that lead from one frame to the other."""
    from_turned_back = invert((*T_base_from[:9], 0.0, 0.0, 0.0))
    turn = compose((*T_base_to[:9], 0.0, 0.0, 0.0), from_turned_back)
    return (
        T_base_to[9] - T_base_from[9],
        T_base_to[10] - T_base_from[10],
        T_base_to[11] - T_base_from[11],
        *rotation_vector(turn),
    )


def partway(T_base_from: Frame, twist: Sequence[float], fraction: float) -> Frame:
    """Straight line of the origin and slerp of the orientation: `fraction` of a twist from `twist_to`."""
    turn = frame_of((0.0, 0.0, 0.0, fraction * twist[3], fraction * twist[4], fraction * twist[5]))
    turned = compose(turn, (*T_base_from[:9], 0.0, 0.0, 0.0))
    return (
        *turned[:9],
        T_base_from[9] + fraction * twist[0],
        T_base_from[10] + fraction * twist[1],
        T_base_from[11] + fraction * twist[2],
    )


Floats = NDArray[np.float64]
Axis = tuple[float, float, float, float, float, float]  # direction, then a point on it, in the base frame

NEWTON_STEPS = 60  # from 1 rad away 6..12 are needed; more means that there is no solution near
NEWTON_STEP_RAD = 0.5  # a longer step leaves the region where the Jacobian means anything
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
        """The arm of a rig as `tomllib` gives it. ValueError unless it has six D-H joints, as it drives.

        `controller_link2_length_m` of [emulation]: by how much (m) link 2 of the controller is longer, as by a factory
        calibration.
        """
        arm = rig["arm"]
        if arm["model"] != "dh" or len(arm["joint"]) != 6:
            raise ValueError(
                f'rig file: arm.model = "{arm["model"]}" with {len(arm["joint"])} joints cannot be driven by the '
                'emulated UR controller; it takes model = "dh" and six [[arm.joint]]'
            )
        links = [Link(j["a_m"], j["alpha_rad"], j["d_m"], j.get("theta_offset_rad", 0.0)) for j in arm["joint"]]
        longer_m = rig.get("emulation", {}).get("controller_link2_length_m", 0.0)
        links[1] = replace(links[1], a_m=links[1].a_m + longer_m * math.copysign(1.0, links[1].a_m))
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
