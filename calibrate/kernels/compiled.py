"""The compiled loops: serial arms over blocks of poses, points with Jacobians, and fused normal equations.

Everything that numba compiles is in this one file, because its cache notices changes of a file, not of what that file
imports. Scratch of a block is one flat array of rows with one value a pose (structure of arrays), so that every inner
loop runs over neighbouring numbers with offsets that the compiler can compare, and becomes vector instructions.
A frame is 12 rows: x, y, z of its axes and of its origin, base row by base row (x_0 y_0 z_0 o_0 x_1 ...).
What the arguments mean is said in serial.py, which is also the typed face of this file.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
# pyright: reportMissingParameterType=false, reportUnknownArgumentType=false

import math
from typing import Any

import numpy as np
from numba import njit

BLOCK = 128  # poses: measured best of 64, 96, 128, 192 and 256
FRAME = 12 * BLOCK
TILE = 4  # columns a side of one register tile of J'J

# Cody-Waite reduction by pi/2 and polynomials on |x| <= pi/4. Source: Moshier, Cephes library, sin.c (netlib);
# method: Muller, Elementary Functions, 3rd ed. 2016, ch. 11.2. The two leading parts have 24 and 25 significant bits.
TWO_OVER_PI = 2.0 / math.pi
PI_2_HIGH, PI_2_MIDDLE, PI_2_LOW = 1.57079625129699707031e0, 7.54978941586159635335e-8, 5.39030285815811905290e-15
LIMIT = 1e8  # rad: beyond, the reduction would lose digits, and no joint turns so far
ROUND = 6755399441055744.0  # 1.5 * 2^52: added and taken away, it rounds to the nearest whole number
S1, S2, S3 = -1.66666666666666307295e-1, 8.33333333332211858878e-3, -1.98412698295895385996e-4
S4, S5, S6 = 2.75573136213857245213e-6, -2.50507477628578072866e-8, 1.58962301576546568060e-10
C1, C2, C3 = 4.16666666666665929218e-2, -1.38888888888730564116e-3, 2.48015872888517045348e-5
C4, C5, C6 = -2.75573141792967388112e-7, 2.08757008419747316778e-9, -1.13585365213876817300e-11

FAST: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}
SUMS: dict[str, Any] = {**FAST, "fastmath": {"contract", "nsz", "reassoc"}}  # long sums may be added in another order


@njit(**FAST)
def sincos(angle):
    """Sine and cosine to 2e-16 (measured: 1.73e-16, up to LIMIT); nan beyond LIMIT and for nan."""
    angle = angle if abs(angle) <= LIMIT else math.nan
    turns = (angle * TWO_OVER_PI + ROUND) - ROUND
    x = ((angle - turns * PI_2_HIGH) - turns * PI_2_MIDDLE) - turns * PI_2_LOW
    xx = x * x
    s = x + x * xx * (S1 + xx * (S2 + xx * (S3 + xx * (S4 + xx * (S5 + xx * S6)))))
    c = 1.0 - 0.5 * xx + xx * xx * (C1 + xx * (C2 + xx * (C3 + xx * (C4 + xx * (C5 + xx * C6)))))
    half = math.floor(turns * 0.5)
    odd = turns - 2.0 * half  # 0 or 1: sine and cosine change places
    flip = 1.0 - 2.0 * (half - 2.0 * math.floor(half * 0.5))  # sign of the second half turn
    sine = c if odd > 0.5 else s
    cosine = -s if odd > 0.5 else c
    return flip * sine, flip * cosine


@njit(**FAST)
def sincos_all(angle, sine, cosine):
    for k in range(angle.size):
        sine[k], cosine[k] = sincos(angle[k])


@njit(**FAST)
def _turns(q, offset, first, count, B, at):
    """Rows cos, sin of every joint from place `at`; a short block repeats its last pose."""
    for i in range(q.shape[1]):
        row, add = B[at + 2 * i * BLOCK : at + (2 * i + 2) * BLOCK], offset[i]
        for k in range(count):
            row[k] = q[first + k, i] + add
        for k in range(count, BLOCK):
            row[k] = row[count - 1]
        for k in range(BLOCK):
            row[BLOCK + k], row[k] = sincos(row[k])


@njit(**FAST)
def _place(D, F):
    """A frame that is the same at every pose."""
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
def _first(D, turn, F0, F1):
    """Frame D = F0 turned about z, times F1: what `_place` and `_advance` do, in a third of the time."""
    for r in range(3):
        for j in range(4):
            row = D[(4 * r + j) * BLOCK : (4 * r + j + 1) * BLOCK]
            by_cos = F0[r, 0] * F1[0, j] + F0[r, 1] * F1[1, j]
            by_sin = F0[r, 1] * F1[0, j] - F0[r, 0] * F1[1, j]
            rest = F0[r, 2] * F1[2, j] + (F0[r, 3] if j == 3 else 0.0)
            for k in range(BLOCK):
                row[k] = turn[k] * by_cos + turn[BLOCK + k] * by_sin + rest


@njit(**FAST)
def flange(fixed, offset, q, out):
    n = q.shape[1]
    at = 2 * FRAME
    B = np.empty(at + 2 * n * BLOCK)
    even, odd = B[:FRAME], B[FRAME:at]
    for first in range(0, q.shape[0], BLOCK):
        count = min(BLOCK, q.shape[0] - first)
        _turns(q, offset, first, count, B, at)
        _first(odd, B[at : at + 2 * BLOCK], fixed[0], fixed[1])
        for i in range(1, n):
            turn = B[at + 2 * i * BLOCK : at + 2 * (i + 1) * BLOCK]
            if i & 1:
                _advance(odd, even, turn, fixed[i + 1])
            else:
                _advance(even, odd, turn, fixed[i + 1])
        _unpack(odd if n & 1 else even, out[first : first + count])


@njit(**FAST)
def _unpack(S, out):
    """Rows of a frame to (pose, 16) matrices."""
    for k in range(out.shape[0]):
        for j in range(12):
            out[k, j] = S[j * BLOCK + k]
        out[k, 12] = 0.0
        out[k, 13] = 0.0
        out[k, 14] = 0.0
        out[k, 15] = 1.0


@njit(**FAST)
def _chain(fixed, offset, q, first, count, B, at):
    """Frames 1 ... n of a block, frame i at i * FRAME; frame 0 is the same at every pose and stays."""
    _turns(q, offset, first, count, B, at)
    _first(B[FRAME : 2 * FRAME], B[at : at + 2 * BLOCK], fixed[0], fixed[1])
    for i in range(1, q.shape[1]):
        S, D = B[i * FRAME : (i + 1) * FRAME], B[(i + 1) * FRAME : (i + 2) * FRAME]
        _advance(S, D, B[at + 2 * i * BLOCK : at + 2 * (i + 1) * BLOCK], fixed[i + 1])


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
def _arm_columns(B, frames, twists, P, seen, J, first, count):
    """Velocity of the point by every twist, to J (3 column, pose); `frames` (column,) rising: which frame it moves."""
    known = -1
    for column in range(frames.size):
        S = B[frames[column] * FRAME : (frames[column] + 1) * FRAME]
        if frames[column] != known:
            known = frames[column]
            _seen_from(S, P, seen)
        end = first + count
        _velocity(
            S,
            seen,
            twists[column],
            J[3 * column, first:end],
            J[3 * column + 1, first:end],
            J[3 * column + 2, first:end],
        )


@njit(**FAST)
def twists(fixed, offset, frames, body, q, out):
    """Base twists [v; w] (pose, 6, column) of the flange by every parameter."""
    n, poses = q.shape[1], q.shape[0]
    at = (n + 1) * FRAME
    B = np.empty(at + 2 * n * BLOCK)
    _place(B[:FRAME], fixed[0])
    for first in range(0, poses, BLOCK):
        count = min(BLOCK, poses - first)
        _chain(fixed, offset, q, first, count, B, at)
        for k in range(count):
            for column in range(frames.size):
                S, b, to = B[frames[column] * FRAME : (frames[column] + 1) * FRAME], body[column], out[first + k]
                for r in range(3):
                    x, y, z = S[4 * r * BLOCK + k], S[(4 * r + 1) * BLOCK + k], S[(4 * r + 2) * BLOCK + k]
                    to[r, column], to[3 + r, column] = (
                        (x * b[0] + y * b[1] + z * b[2]),
                        (x * b[3] + y * b[4] + z * b[5]),
                    )
                ox, oy, oz = S[3 * BLOCK + k], S[7 * BLOCK + k], S[11 * BLOCK + k]
                wx, wy, wz = to[3, column], to[4, column], to[5, column]
                to[0, column] += oy * wz - oz * wy
                to[1, column] += oz * wx - ox * wz
                to[2, column] += ox * wy - oy * wx


@njit(**FAST)
def point_jacobian(fixed, offset, frames, twists, tool, q, points, J):
    n, poses = q.shape[1], q.shape[0]
    at = (n + 1) * FRAME
    B, P, seen = np.empty(at + 2 * n * BLOCK), np.empty(3 * BLOCK), np.empty(3 * BLOCK)
    _place(B[:FRAME], fixed[0])
    for first in range(0, poses, BLOCK):
        count = min(BLOCK, poses - first)
        _chain(fixed, offset, q, first, count, B, at)
        _point(B[n * FRAME : (n + 1) * FRAME], tool, P)
        for r in range(3):
            points[r, first : first + count] = P[r * BLOCK : r * BLOCK + count]
        _arm_columns(B, frames, twists, P, seen, J, first, count)


@njit(**SUMS)
def _tile(A, B, out):
    """Add A B' to out, for TILE columns each, over 3 BLOCK rows."""
    length = 3 * BLOCK
    a0, a1, a2, a3 = A[:length], A[length : 2 * length], A[2 * length : 3 * length], A[3 * length : 4 * length]
    b0, b1, b2, b3 = B[:length], B[length : 2 * length], B[2 * length : 3 * length], B[3 * length : 4 * length]
    s00 = s01 = s02 = s03 = s10 = s11 = s12 = s13 = 0.0
    s20 = s21 = s22 = s23 = s30 = s31 = s32 = s33 = 0.0
    for k in range(length):
        x, y, z, u = a0[k], a1[k], a2[k], a3[k]
        c, d, e, f = b0[k], b1[k], b2[k], b3[k]
        s00, s01, s02, s03 = s00 + x * c, s01 + x * d, s02 + x * e, s03 + x * f
        s10, s11, s12, s13 = s10 + y * c, s11 + y * d, s12 + y * e, s13 + y * f
        s20, s21, s22, s23 = s20 + z * c, s21 + z * d, s22 + z * e, s23 + z * f
        s30, s31, s32, s33 = s30 + u * c, s31 + u * d, s32 + u * e, s33 + u * f
    for column, value in enumerate((s00, s01, s02, s03)):
        out[0, column] += value
    for column, value in enumerate((s10, s11, s12, s13)):
        out[1, column] += value
    for column, value in enumerate((s20, s21, s22, s23)):
        out[2, column] += value
    for column, value in enumerate((s30, s31, s32, s33)):
        out[3, column] += value


@njit(**FAST)
def _position_rows(B, n, P, device, twists, observed, first, count, J, tool_row):
    """Rows by tool, by device and of the residual, in the base: where the target is, less where the device saw it."""
    S, device_row, residual_row = B[n * FRAME : (n + 1) * FRAME], tool_row + 9, tool_row + 27
    for j in range(3):
        for r in range(3):
            J[tool_row + 3 * j + r, :] = S[(4 * r + j) * BLOCK : (4 * r + j + 1) * BLOCK]
    for j in range(6):
        vx, vy, vz, wx, wy, wz = twists[j, 0], twists[j, 1], twists[j, 2], twists[j, 3], twists[j, 4], twists[j, 5]
        J0, J1, J2 = J[device_row + 3 * j], J[device_row + 3 * j + 1], J[device_row + 3 * j + 2]
        for k in range(BLOCK):
            x, y, z = P[k], P[BLOCK + k], P[2 * BLOCK + k]
            J0[k], J1[k], J2[k] = wz * y - wy * z - vx, wx * z - wz * x - vy, wy * x - wx * y - vz
    for r in range(3):
        row, point = J[residual_row + r], P[r * BLOCK : (r + 1) * BLOCK]
        a, b, c, d = device[r, 0], device[r, 1], device[r, 2], device[r, 3]
        for k in range(count):
            o = observed[first + k]
            row[k] = point[k] - (a * o[0] + b * o[1] + c * o[2] + d)
        for k in range(count, BLOCK):
            row[k] = 0.0


@njit(**FAST)
def _weigh(W, device, first, count, M, columns, flat):
    """Every column to the device's axes and weighted: M = W R'; poses beyond the data weigh nothing."""
    for r in range(3):
        for c in range(3):
            row, a, b, d = M[(3 * r + c) * BLOCK : (3 * r + c + 1) * BLOCK], device[c, 0], device[c, 1], device[c, 2]
            for k in range(count):
                row[k] = W[first + k, r, 0] * a + W[first + k, r, 1] * b + W[first + k, r, 2] * d
            for k in range(count, BLOCK):
                row[k] = 0.0
    for column in range(columns):
        J = flat[3 * column * BLOCK : 3 * (column + 1) * BLOCK]
        for k in range(BLOCK):
            x, y, z = J[k], J[BLOCK + k], J[2 * BLOCK + k]
            J[k] = M[k] * x + M[BLOCK + k] * y + M[2 * BLOCK + k] * z
            J[BLOCK + k] = M[3 * BLOCK + k] * x + M[4 * BLOCK + k] * y + M[5 * BLOCK + k] * z
            J[2 * BLOCK + k] = M[6 * BLOCK + k] * x + M[7 * BLOCK + k] * y + M[8 * BLOCK + k] * z


@njit(**FAST)
def moved_frame(T, deviation, moved, twists):
    """`moved` (4, 4) = T with a deviation (6,) applied on its right, and its base twists (6 deviation, 6) by each.

    The formulas of calibrate/rigid.py, pose_offset and pose_offset_twists: Exp(r) = 1 + a K + b K^2 and its left
    Jacobian 1 + b K + c K^2, K the cross matrix of r.
    """
    r, square = deviation[3:], deviation[3] ** 2 + deviation[4] ** 2 + deviation[5] ** 2
    a, b, c = 1.0 - square / 6.0, 0.5 - square / 24.0, (1.0 - square / 20.0) / 6.0  # next terms below 1e-17
    if square >= 1e-8:
        angle = math.sqrt(square)
        a, b, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square, (1.0 - math.sin(angle) / angle) / square
    K = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    twists[:] = 0.0
    moved[3, :3], moved[3, 3] = 0.0, 1.0
    for i in range(3):
        moved[i, 3] = T[i, 3]
        for m in range(3):
            moved[i, 3] += T[i, m] * deviation[m]
    for i in range(3):
        for j in range(3):
            turn, jacobian = 0.0, 0.0
            for m in range(3):
                one, squared = (1.0 if m == j else 0.0), r[m] * r[j] - (square if m == j else 0.0)
                turn += T[i, m] * (one + a * K[m, j] + b * squared)
                jacobian += T[i, m] * (one + b * K[m, j] + c * squared)
            moved[i, j], twists[j, i], twists[3 + j, 3 + i] = turn, T[i, j], jacobian
    x, y, z = moved[0, 3], moved[1, 3], moved[2, 3]
    for j in range(3, 6):  # a turn about an axis through the origin of the frame: v = o x w
        u, v, w = twists[j, 3], twists[j, 4], twists[j, 5]
        twists[j, 0], twists[j, 1], twists[j, 2] = y * w - z * v, z * u - x * w, x * v - y * u


@njit(**FAST)
def position_rows(fixed, offset, frames, twists, tool, T_base_device, deviation, q, observed, W, out, add_up):
    """Whitened [J r] with columns arm, tool, device, residual; or its normal matrix.

    The device stands at T_base_device with a `deviation` (6,).
    `add_up`: `out` (wide, wide), a multiple of TILE, gets the lower triangle of [J r]'[J r] added, the rows staying in
    the cache; otherwise `out` (3 columns, pose) gets the rows.
    """
    n, poses, columns = q.shape[1], q.shape[0], frames.size + 10
    at, tiles = (n + 1) * FRAME, (columns + TILE - 1) // TILE
    B, P, seen = np.empty(at + 2 * n * BLOCK), np.empty(3 * BLOCK), np.empty(3 * BLOCK)
    J, M, side = np.zeros((3 * TILE * tiles, BLOCK)), np.empty(9 * BLOCK), 3 * BLOCK * TILE
    flat = J.reshape(-1)
    device, device_twists = np.empty((4, 4)), np.empty((6, 6))
    moved_frame(T_base_device, deviation, device, device_twists)
    _place(B[:FRAME], fixed[0])
    for first in range(0, poses, BLOCK):
        count = min(BLOCK, poses - first)
        _chain(fixed, offset, q, first, count, B, at)
        _point(B[n * FRAME : at], tool, P)
        _arm_columns(B, frames, twists, P, seen, J, 0, BLOCK)
        _position_rows(B, n, P, device, device_twists, observed, first, count, J, 3 * frames.size)
        _weigh(W, device, first, count, M, columns, flat)
        if add_up:
            for a in range(tiles):
                for b in range(a + 1):
                    into = out[a * TILE : (a + 1) * TILE, b * TILE : (b + 1) * TILE]
                    _tile(flat[a * side : (a + 1) * side], flat[b * side : (b + 1) * side], into)
        else:
            for row in range(3 * columns):
                out[row, first : first + count] = J[row, :count]
