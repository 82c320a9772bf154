"""All compiled code: forward kinematics of serial arms and its derivatives, for batches.

Everything that numba compiles is in this one file, because its cache notices changes of a file, not of what that file
imports. Rows go through in blocks; scratch of a block is one flat array with one value a row side by side (structure of
arrays), at offsets that the compiler can compare: then every inner loop becomes vector instructions.
A frame is 12 such rows: x, y, z of its axes and of its origin, base row by base row (x_0 y_0 z_0 o_0 x_1 ...).
What the arguments mean is stated in compiled.py, the typed face of this file.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
# pyright: reportMissingParameterType=false, reportUnknownArgumentType=false

from typing import Any

import numpy as np
from numba import njit

BLOCK = 128  # rows: measured best of 64, 96, 128, 192 and 256
FRAME = 12 * BLOCK
PER_PART = 7  # slots of a perturbed part: shift 3, turn 3, and the angle of the joint behind it
FAST: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}


@njit(**FAST)
def _turns(half, first, count, B, at):
    """Rows cos, sin of every joint from place `at`, from tan of half the angle; a short block repeats its last row.

    cos = (1 - t^2) / (1 + t^2), sin = 2 t / (1 + t^2): one tangent by numpy's vector instructions instead of sine and
    cosine one by one, which would take three quarters of the time. Error 3e-16, near half a turn as well.
    """
    for i in range(half.shape[1]):
        row = B[at + 2 * i * BLOCK : at + (2 * i + 2) * BLOCK]
        for k in range(count):
            row[k] = half[first + k, i]
        for k in range(count, BLOCK):
            row[k] = row[count - 1]
        for k in range(BLOCK):
            t = row[k]
            share = 1.0 / (1.0 + t * t)
            row[k], row[BLOCK + k] = (1.0 - t * t) * share, 2.0 * t * share


@njit(**FAST)
def _place(D, F):
    """A frame that is the same in every row."""
    for r in range(3):
        for j in range(4):
            row, value = D[(4 * r + j) * BLOCK : (4 * r + j + 1) * BLOCK], F[r, j]
            for k in range(BLOCK):
                row[k] = value


@njit(**FAST)
def _advance(S, D, turn, F):
    """Frame D = frame S, turned about z, times F."""
    f00, f01, f02, f03 = F[0, 0], F[0, 1], F[0, 2], F[0, 3]
    f10, f11, f12, f13 = F[1, 0], F[1, 1], F[1, 2], F[1, 3]
    f20, f21, f22, f23 = F[2, 0], F[2, 1], F[2, 2], F[2, 3]
    for r in range(3):
        a, b = S[4 * r * BLOCK : 4 * (r + 1) * BLOCK], D[4 * r * BLOCK : 4 * (r + 1) * BLOCK]
        for k in range(BLOCK):
            c, s = turn[k], turn[BLOCK + k]
            x, y, z = a[k], a[BLOCK + k], a[2 * BLOCK + k]
            xt, yt = c * x + s * y, c * y - s * x
            b[k] = xt * f00 + yt * f10 + z * f20
            b[BLOCK + k] = xt * f01 + yt * f11 + z * f21
            b[2 * BLOCK + k] = xt * f02 + yt * f12 + z * f22
            b[3 * BLOCK + k] = xt * f03 + yt * f13 + z * f23 + a[3 * BLOCK + k]


@njit(**FAST)
def _chain(fixed, half, first, count, B, at):
    """Frames 1 ... n of a block, frame i at i * FRAME; frame 0 is the same in every row and stays."""
    _turns(half, first, count, B, at)
    for i in range(half.shape[1]):
        S, D = B[i * FRAME : (i + 1) * FRAME], B[(i + 1) * FRAME : (i + 2) * FRAME]
        _advance(S, D, B[at + 2 * i * BLOCK : at + 2 * (i + 1) * BLOCK], fixed[i + 1])


@njit(**FAST)
def flange(fixed, half, out):
    """Flange poses to out (row, 16)."""
    n, rows = half.shape[1], half.shape[0]
    at = (n + 1) * FRAME
    B = np.empty(at + 2 * n * BLOCK)
    _place(B[:FRAME], fixed[0])
    for first in range(0, rows, BLOCK):
        count = min(BLOCK, rows - first)
        _chain(fixed, half, first, count, B, at)
        S = B[n * FRAME : at]
        for k in range(count):
            to = out[first + k]
            for j in range(12):
                to[j] = S[j * BLOCK + k]
            to[12], to[13], to[14], to[15] = 0.0, 0.0, 0.0, 1.0


@njit(**FAST)
def twists(fixed, half, frames, body, out):
    """Base twists [v; w] out (row, 6, column) of the flange by every parameter."""
    n, rows = half.shape[1], half.shape[0]
    at = (n + 1) * FRAME
    B = np.empty(at + 2 * n * BLOCK)
    _place(B[:FRAME], fixed[0])
    for first in range(0, rows, BLOCK):
        count = min(BLOCK, rows - first)
        _chain(fixed, half, first, count, B, at)
        for k in range(count):
            for column in range(frames.size):
                S, b, to = B[frames[column] * FRAME : (frames[column] + 1) * FRAME], body[column], out[first + k]
                for r in range(3):
                    x, y, z = S[4 * r * BLOCK + k], S[(4 * r + 1) * BLOCK + k], S[(4 * r + 2) * BLOCK + k]
                    to[r, column] = x * b[0] + y * b[1] + z * b[2]
                    to[3 + r, column] = x * b[3] + y * b[4] + z * b[5]
                ox, oy, oz = S[3 * BLOCK + k], S[7 * BLOCK + k], S[11 * BLOCK + k]
                wx, wy, wz = to[3, column], to[4, column], to[5, column]
                to[0, column] += oy * wz - oz * wy
                to[1, column] += oz * wx - ox * wz
                to[2, column] += ox * wy - oy * wx


@njit(**FAST)
def _point(S, at, P):
    """Rows P of a point `at` (3,) that is fixed in a frame S, in the base."""
    x, y, z = at[0], at[1], at[2]
    for r in range(3):
        a, b = S[4 * r * BLOCK : 4 * (r + 1) * BLOCK], P[r * BLOCK : (r + 1) * BLOCK]
        for k in range(BLOCK):
            b[k] = a[k] * x + a[BLOCK + k] * y + a[2 * BLOCK + k] * z + a[3 * BLOCK + k]


@njit(**FAST)
def _seen_from(S, P, seen):
    """Rows of a base point P in a frame's own axes."""
    for k in range(BLOCK):
        x = P[k] - S[3 * BLOCK + k]
        y = P[BLOCK + k] - S[7 * BLOCK + k]
        z = P[2 * BLOCK + k] - S[11 * BLOCK + k]
        seen[k] = S[k] * x + S[4 * BLOCK + k] * y + S[8 * BLOCK + k] * z
        seen[BLOCK + k] = S[BLOCK + k] * x + S[5 * BLOCK + k] * y + S[9 * BLOCK + k] * z
        seen[2 * BLOCK + k] = S[2 * BLOCK + k] * x + S[6 * BLOCK + k] * y + S[10 * BLOCK + k] * z


@njit(**FAST)
def _velocity(S, seen, twist, J0, J1, J2):
    """Rows of the point's velocity when the frame moves by a twist of its own: R (v + w x seen)."""
    vx, vy, vz, wx, wy, wz = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    for k in range(J0.size):
        x, y, z = seen[k], seen[BLOCK + k], seen[2 * BLOCK + k]
        ux, uy, uz = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        J0[k] = S[k] * ux + S[BLOCK + k] * uy + S[2 * BLOCK + k] * uz
        J1[k] = S[4 * BLOCK + k] * ux + S[5 * BLOCK + k] * uy + S[6 * BLOCK + k] * uz
        J2[k] = S[8 * BLOCK + k] * ux + S[9 * BLOCK + k] * uy + S[10 * BLOCK + k] * uz


@njit(**FAST)
def point_jacobian(fixed, half, frames, twists, tool, points, J):
    """A point of the flange to points (3, row), its velocity by every twist to J (3 column, row)."""
    n, rows = half.shape[1], half.shape[0]
    at = (n + 1) * FRAME
    B, P, seen = np.empty(at + 2 * n * BLOCK), np.empty(3 * BLOCK), np.empty(3 * BLOCK)
    _place(B[:FRAME], fixed[0])
    for first in range(0, rows, BLOCK):
        end = min(first + BLOCK, rows)
        _chain(fixed, half, first, end - first, B, at)
        _point(B[n * FRAME : at], tool, P)
        for r in range(3):
            points[r, first:end] = P[r * BLOCK : r * BLOCK + end - first]
        known = -1
        for column in range(frames.size):
            S = B[frames[column] * FRAME : (frames[column] + 1) * FRAME]
            if frames[column] != known:
                known = frames[column]
                _seen_from(S, P, seen)
            J0, J1, J2 = J[3 * column, first:end], J[3 * column + 1, first:end], J[3 * column + 2, first:end]
            _velocity(S, seen, twists[column], J0, J1, J2)


@njit(**FAST)
def _jolted(D, turn, half, p):
    """Points p (3, row) under a rotation vector D[3:6], then a shift D[:3]: Rodrigues' formula.

    `turn` (row,) is the length of the rotation vector, `half` the tangent of half of it.
    """
    for k in range(p.shape[1]):
        u, v, w, x, y, z = D[3, k], D[4, k], D[5, k], p[0, k], p[1, k], p[2, k]
        t = half[k] / turn[k] if turn[k] > 0.0 else 0.5
        a = 2.0 * t / (1.0 + half[k] * half[k])  # sin(turn) / turn
        b = a * t  # (1 - cos(turn)) / turn^2
        cx, cy, cz = v * z - w * y, w * x - u * z, u * y - v * x
        p[0, k] = x + a * cx + b * (v * cz - w * cy) + D[0, k]
        p[1, k] = y + a * cy + b * (w * cx - u * cz) + D[1, k]
        p[2, k] = z + a * cz + b * (u * cy - v * cx) + D[2, k]


@njit(**FAST)
def perturbed_points(fixed, half, turn, half_turn, tool, moved, D, out):
    """A point behind the last part, in the base, of arms with perturbations D (PER_PART part, row): out (3, row).

    From the point back to the base, part by part. `half` (joint, row) of the perturbed joint angles, `turn` and
    `half_turn` (part, row) of the perturbing rotation vectors.
    """
    for r in range(3):
        out[r, :] = tool[r]
    for i in range(fixed.shape[0] - 1, -1, -1):
        if i < half.shape[0]:
            for k in range(out.shape[1]):
                t, x, y = half[i, k], out[0, k], out[1, k]
                share = 1.0 / (1.0 + t * t)
                c, s = (1.0 - t * t) * share, 2.0 * t * share
                out[0, k], out[1, k] = c * x - s * y, s * x + c * y
        if moved[i]:
            _jolted(D[PER_PART * i : PER_PART * i + 6], turn[i], half_turn[i], out)
        F = fixed[i]
        for k in range(out.shape[1]):
            x, y, z = out[0, k], out[1, k], out[2, k]
            out[0, k] = F[0, 0] * x + F[0, 1] * y + F[0, 2] * z + F[0, 3]
            out[1, k] = F[1, 0] * x + F[1, 1] * y + F[1, 2] * z + F[1, 3]
            out[2, k] = F[2, 0] * x + F[2, 1] * y + F[2, 2] * z + F[2, 3]
