"""Poses as the controller writes them: [x, y, z, rx, ry, rz], metres and a rotation vector.

Plain floats, because they run every tick.
A `Frame` holds the columns of a rotation and an origin: (xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz), so that
x = R[:, 0] and so on. Rotation vector and quaternion formulas: Murray, Li, Sastry, "A Mathematical Introduction to
Robotic Manipulation", section 2.2 (Rodrigues); Shepperd, "Quaternion from rotation matrix", 1978.
"""

import math
from collections.abc import Sequence

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
