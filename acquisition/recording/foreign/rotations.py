"""Orientations as the makers of robots and measuring devices write them, turned into rotation vectors.

Every function takes and gives arrays with one orientation a row, in rad; a quaternion is (w, x, y, z). All ways lead
through quaternions: they have no singular place, and their vector part keeps small rotations to the last digit.
Conventions of the makers: Roboception, rc_cube documentation, appendix "Pose formats" (pages ABB, FANUC, KUKA,
Universal Robots), https://doc.rc-cube.com.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
UNIT_TOLERANCE = 1e-3  # of a quaternion's length or a matrix's rows from 1: beyond rounding to four digits


def of_abc(abc_rad: Floats) -> Floats:
    """(row, 3) A, B, C -> rotation vectors: A about Z, B about the turned Y', C about the twice turned X''.

    KUKA: R = Rz(A) Ry(B) Rx(C), z-y'-x''. Controllers write degrees. Source: see above, page KUKA.
    """
    a, b, c = np.moveaxis(abc_rad, -1, 0)
    return vectors_of(multiplied(multiplied(_about(2, a), _about(1, b)), _about(0, c)))


def of_wpr(wpr_rad: Floats) -> Floats:
    """(row, 3) W, P, R -> rotation vectors: W about the fixed X, then P about the fixed Y, then R about the fixed Z.

    FANUC: R = Rz(R) Ry(P) Rx(W), so that W, P, R are KUKA's C, B, A. Controllers write degrees. Source: see above,
    page FANUC.
    """
    return of_abc(wpr_rad[..., ::-1])


def of_wxyz(quaternion: Floats) -> Floats:
    """(row, 4) quaternions w, x, y, z of any length -> rotation vectors.

    ABB: q1, q2, q3, q4 of RAPID's `orient` are w, x, y, z. Source: see above, page ABB.
    """
    return vectors_of(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True))


def of_xyzw(quaternion: Floats) -> Floats:
    """(row, 4) quaternions x, y, z, w -> rotation vectors. ROS: geometry_msgs/Quaternion."""
    return of_wxyz(np.roll(quaternion, 1, axis=-1))


def of_vectors(vector_rad: Floats) -> Floats:
    """(row, 3) rotation vectors, shortened to at most half a turn.

    Universal Robots: Rx, Ry, Rz of a pose are axis times angle, in rad. Source: see above, page Universal Robots. Where
    a pendant or another program calls roll, pitch and yaw Rx, Ry, Rz, these are `wpr`.
    """
    half = 0.5 * np.linalg.norm(vector_rad, axis=-1, keepdims=True)
    return vectors_of(np.concatenate([np.cos(half), 0.5 * vector_rad * np.sinc(half / np.pi)], axis=-1))


def of_matrices(matrix: Floats) -> Floats:
    """(row, 9) rotation matrices row by row -> rotation vectors.

    The quaternion is the largest column of 4 q qT, whose elements are sums of the matrix's: S. W. Shepperd, Quaternion
    from rotation matrix, Journal of Guidance and Control 1(3), 1978.
    """
    m = matrix.reshape(-1, 3, 3)
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    wx, wy, wz = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    xy, xz, yz = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    product = np.array(
        [
            [1 + xx + yy + zz, wx, wy, wz],
            [wx, 1 + xx - yy - zz, xy, xz],
            [wy, xy, 1 - xx + yy - zz, yz],
            [wz, xz, yz, 1 - xx - yy + zz],
        ]
    )
    best = np.argmax(np.einsum("iin->in", product), axis=0)
    return of_wxyz(product[:, best, np.arange(len(m))].T)


def vectors_of(quaternion: Floats) -> Floats:
    """(row, 4) unit quaternions w, x, y, z -> rotation vectors (row, 3) of at most half a turn."""
    q = np.where(quaternion[..., :1] < 0.0, -quaternion, quaternion)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    with np.errstate(invalid="ignore", divide="ignore"):
        return q[..., 1:] * np.where(sine > 0.0, angle / sine, 2.0)


def multiplied(one: Floats, other: Floats) -> Floats:
    """Hamilton's product of quaternions: the rotation `other`, then `one`."""
    w1, x1, y1, z1 = np.moveaxis(one, -1, 0)
    w2, x2, y2, z2 = np.moveaxis(other, -1, 0)
    return np.stack(
        [
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ],
        axis=-1,
    )


def bad_quaternion(quaternion: Floats) -> NDArray[np.bool_]:
    """(row,) whether the length of a quaternion is clearly not 1; a missing one is not bad."""
    return np.abs(np.linalg.norm(quaternion, axis=-1) - 1.0) > UNIT_TOLERANCE


def bad_matrix(matrix: Floats) -> NDArray[np.bool_]:
    """(row,) whether (row, 9) is clearly no rotation: rows not orthonormal, or a mirror image."""
    m = matrix.reshape(-1, 3, 3)
    apart = np.abs(m @ m.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    with np.errstate(invalid="ignore"):
        return (apart > UNIT_TOLERANCE) | (np.linalg.det(np.nan_to_num(m)) < 0.0)


def _about(axis: int, angle_rad: Floats) -> Floats:
    """Quaternions of turns about a coordinate axis."""
    q = np.zeros((*angle_rad.shape, 4))
    q[..., 0], q[..., 1 + axis] = np.cos(0.5 * angle_rad), np.sin(0.5 * angle_rad)
    return q


# name -> conversion, number of columns; angles in rad where they are angles
CONVENTIONS: Mapping[str, tuple[Callable[[Floats], Floats], int]] = MappingProxyType(
    {
        "abc": (of_abc, 3),
        "wpr": (of_wpr, 3),
        "rotvec": (of_vectors, 3),
        "quaternion": (of_wxyz, 4),
        "quaternion-xyzw": (of_xyzw, 4),
        "matrix": (of_matrices, 9),
    }
)
