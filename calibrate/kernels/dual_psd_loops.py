"""The compiled loops of the dual PSD: whitened derivatives of all spots, and what is left of them, pose by pose.

A file of its own, calling no loop of another one: numba's cache notices changes of the file alone. Scratch is kept as
rows with one value a pose, so that inner loops become vector instructions (compiled.py says more). Each spot
coordinate is a wrench on the beam, [f; m] in the base: a twist [v; w] moves it by f.v + m.w. A wrench is weighted once,
carried into the frame of a parameter, and there meets the constant twist of that parameter.
What the arguments mean is said in dual_psd_rows.py, which is also the typed face of this file.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
# pyright: reportMissingParameterType=false, reportUnknownArgumentType=false

from typing import Any

import numpy as np
from numba import njit

BLOCK = 128  # poses, as in compiled.py
WRENCH = 9  # f, m, and f times the path of the light, by which a tilt of the laser acts
FAST: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}


@njit(**FAST)
def _frames(fixed, cosine, sine, B):
    """Rows x, y, z, origin of frames 0 ... n, base row by base row, at the poses of cosine and sine (joint, pose)."""
    poses = cosine.shape[1]
    for r in range(3):
        for j in range(4):
            B[0, 4 * r + j, :] = fixed[0, r, j]
    for i in range(cosine.shape[0]):
        F, c, s = fixed[i + 1], cosine[i], sine[i]
        for r in range(3):
            S, D = B[i, 4 * r : 4 * r + 4], B[i + 1, 4 * r : 4 * r + 4]
            for k in range(poses):
                x = c[k] * S[0, k] + s[k] * S[1, k]
                y = c[k] * S[1, k] - s[k] * S[0, k]
                z = S[2, k]
                D[0, k] = x * F[0, 0] + y * F[1, 0] + z * F[2, 0]
                D[1, k] = x * F[0, 1] + y * F[1, 1] + z * F[2, 1]
                D[2, k] = x * F[0, 2] + y * F[1, 2] + z * F[2, 2]
                D[3, k] = x * F[0, 3] + y * F[1, 3] + z * F[2, 3] + S[3, k]


@njit(**FAST)
def _beam(flange, k, origin, direction, p, d):
    """Base line of the laser at pose k of a block."""
    for r in range(3):
        x, y, z = flange[4 * r, k], flange[4 * r + 1, k], flange[4 * r + 2, k]
        p[r] = x * origin[0] + y * origin[1] + z * origin[2] + flange[4 * r + 3, k]
        d[r] = x * direction[0] + y * direction[1] + z * direction[2]


@njit(**FAST)
def _strike(p, d, face, gain, spots, G):
    """Spot (2,) on a face as the unreflected beam sees it, and its two wrenches (2, WRENCH), times the gains."""
    qx = face[0, 0] * p[0] + face[0, 1] * p[1] + face[0, 2] * p[2] + face[0, 3]
    qy = face[1, 0] * p[0] + face[1, 1] * p[1] + face[1, 2] * p[2] + face[1, 3]
    qz = face[2, 0] * p[0] + face[2, 1] * p[1] + face[2, 2] * p[2] + face[2, 3]
    ex = face[0, 0] * d[0] + face[0, 1] * d[1] + face[0, 2] * d[2]
    ey = face[1, 0] * d[0] + face[1, 1] * d[1] + face[1, 2] * d[2]
    ez = face[2, 0] * d[0] + face[2, 1] * d[1] + face[2, 2] * d[2]
    travel = -qz / ez
    spots[0], spots[1] = qx + travel * ex, qy + travel * ey
    x, y, z = p[0] + travel * d[0], p[1] + travel * d[1], p[2] + travel * d[2]
    for axis in range(2):
        lean = (ex if axis == 0 else ey) / ez
        f0 = gain[axis] * (face[axis, 0] - lean * face[2, 0])
        f1 = gain[axis] * (face[axis, 1] - lean * face[2, 1])
        f2 = gain[axis] * (face[axis, 2] - lean * face[2, 2])
        G[axis, 0], G[axis, 1], G[axis, 2] = f0, f1, f2
        G[axis, 3], G[axis, 4], G[axis, 5] = y * f2 - z * f1, z * f0 - x * f2, x * f1 - y * f0
        G[axis, 6], G[axis, 7], G[axis, 8] = travel * f0, travel * f1, travel * f2


@njit(**FAST)
def _wrenches(flange, origin, direction, faces, group, gain, W, observed, first, count, spots, G, H, rest):
    """Weighted wrenches H (4, WRENCH, pose) and residuals rest (4, pose) of a block; plain ones stay in G and spots."""
    p, d = np.empty(3), np.empty(3)
    for k in range(count):
        at = first + k
        _beam(flange, k, origin, direction, p, d)
        for face in range(2):
            of = slice(2 * face, 2 * face + 2)
            _strike(p, d, faces[group[at], face], gain[of], spots[k, of], G[k, of])
        for r in range(4):
            misfit = 0.0
            for c in range(4):
                misfit += W[at, r, c] * (gain[c] * spots[k, c] - observed[at, c])
            rest[r, at] = misfit
            for j in range(WRENCH):
                value = 0.0
                for c in range(4):
                    value += W[at, r, c] * G[k, c, j]
                H[r, j, k] = value


@njit(**FAST)
def _arm_columns(B, H, frames, twists, local, out, first, count):
    """Columns of the arm; `frames` (column,) rising: which frame each moves."""
    known = -1
    for column in range(frames.size):
        S = B[frames[column]]
        if frames[column] != known:
            known = frames[column]
            for r in range(4):
                for k in range(count):
                    f0, f1, f2 = H[r, 0, k], H[r, 1, k], H[r, 2, k]
                    x, y, z = S[3, k], S[7, k], S[11, k]
                    m0 = H[r, 3, k] + f1 * z - f2 * y
                    m1 = H[r, 4, k] + f2 * x - f0 * z
                    m2 = H[r, 5, k] + f0 * y - f1 * x
                    for j in range(3):
                        local[r, j, k] = S[j, k] * f0 + S[4 + j, k] * f1 + S[8 + j, k] * f2
                        local[r, 3 + j, k] = S[j, k] * m0 + S[4 + j, k] * m1 + S[8 + j, k] * m2
        t0, t1, t2 = twists[column, 0], twists[column, 1], twists[column, 2]
        t3, t4, t5 = twists[column, 3], twists[column, 4], twists[column, 5]
        for r in range(4):
            row, L = out[column, r, first : first + count], local[r]
            for k in range(count):
                row[k] = t0 * L[0, k] + t1 * L[1, k] + t2 * L[2, k] + t3 * L[3, k] + t4 * L[4, k] + t5 * L[5, k]


@njit(**FAST)
def _mount_columns(flange, H, across, out, first, count):
    """Columns of two shifts, then two tilts, of the laser along `across` (2, 3) in the flange."""
    for j in range(2):
        u0, u1, u2 = across[j, 0], across[j, 1], across[j, 2]
        for r in range(4):
            shift, tilt = out[j, r, first : first + count], out[2 + j, r, first : first + count]
            for k in range(count):
                x = flange[0, k] * u0 + flange[1, k] * u1 + flange[2, k] * u2
                y = flange[4, k] * u0 + flange[5, k] * u1 + flange[6, k] * u2
                z = flange[8, k] * u0 + flange[9, k] * u1 + flange[10, k] * u2
                shift[k] = x * H[r, 0, k] + y * H[r, 1, k] + z * H[r, 2, k]
                tilt[k] = x * H[r, 6, k] + y * H[r, 7, k] + z * H[r, 8, k]


@njit(**FAST)
def _fixture_columns(spots, G, W, group, seen, columns, gains, out, first, count):
    """Columns of the gains where asked for, and of what moves faces by base twists `seen` (group, face, column, 6)."""
    plain = np.empty(4)
    for k in range(count):
        at, g = first + k, group[first + k]
        if gains:
            for c in range(4):
                for r in range(4):
                    out[c, r, at] = W[at, r, c] * spots[k, c]
        for j in range(seen.shape[2]):
            for c in range(4):
                T = seen[g, c // 2, j]
                plain[c] = G[k, c, 0] * T[0] + G[k, c, 1] * T[1] + G[k, c, 2] * T[2]
                plain[c] += G[k, c, 3] * T[3] + G[k, c, 4] * T[4] + G[k, c, 5] * T[5]
            to = columns[g, j]
            for r in range(4):
                out[to, r, at] = (
                    W[at, r, 0] * plain[0] + W[at, r, 1] * plain[1] + W[at, r, 2] * plain[2] + W[at, r, 3] * plain[3]
                )


@njit(**FAST)
def rows(
    fixed,
    cosine,
    sine,
    frames,
    twists,
    origin,
    direction,
    across,
    gain,
    faces,
    seen,
    columns,
    gains,
    group,
    W,
    observed,
    out,
):
    """Whitened columns (arm, laser, gains, fixture, residual) x (psd1 x, y, psd2 x, y) x pose; `out` zero before.

    Without laser axes (`across` of length 0) only the arm's columns and the residual are made.
    """
    n, poses, arm = cosine.shape[0], cosine.shape[1], frames.size
    B, H, local = np.empty((n + 1, 12, BLOCK)), np.zeros((4, WRENCH, BLOCK)), np.empty((4, 6, BLOCK))
    spots, G = np.empty((BLOCK, 4)), np.empty((BLOCK, 4, WRENCH))
    rest = out[out.shape[0] - 1]
    for first in range(0, poses, BLOCK):
        count = min(BLOCK, poses - first)
        _frames(fixed, cosine[:, first : first + count], sine[:, first : first + count], B)
        _wrenches(B[n], origin, direction, faces, group, gain, W, observed, first, count, spots, G, H, rest)
        _arm_columns(B, H, frames, twists, local, out, first, count)
        if across.shape[0] == 2:
            _mount_columns(B[n], H, across, out[arm : arm + 4], first, count)
            _fixture_columns(spots, G, W, group, seen, columns, gains, out[arm + 4 :], first, count)
