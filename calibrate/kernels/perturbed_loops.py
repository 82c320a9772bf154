"""The compiled loops of the error simulation: drawn arms in blocks, and where each puts its probe.

A file of its own, calling no loop of another one: numba's cache notices changes of the file alone. Scratch is kept as
rows with one value an arm, so that inner loops become vector instructions (compiled.py says more). Random numbers are
a function of seed, arm and column alone, so that arms may be drawn in any order, by any number of workers.
What the arguments mean is said in perturbed.py, which is also the typed face of this file.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
# pyright: reportMissingParameterType=false, reportUnknownArgumentType=false

import math
from typing import Any

import numpy as np
from numba import njit

BLOCK = 128  # arms: as many as compiled.py has poses
CELLS = 1024  # of a quantile table; the two outer ones have as many of their own
BINS = 512  # of a histogram of error lengths; what is longer falls into the last one
NORMAL, UNIFORM, TABLE, CONSTANT = 0, 1, 2, 3  # laws of a column
FAST: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}

# Philox4x32-10. Source: Salmon, Moraes, Dror, Shaw, Parallel random numbers: as easy as 1, 2, 3, SC 2011, section 3.3.
ROUND_0, ROUND_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
WEYL_0, WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
WORD, HALF = np.uint64(0xFFFFFFFF), np.uint64(32)
UNIT = 1.0 / 4294967296.0

MANTISSA, ONE = np.int64(0x000FFFFFFFFFFFFF), np.int64(0x3FF0000000000000)  # of a double, IEEE 754
SHIFT, BIAS = np.int64(52), 1023.0
TWO_PI, LN_2, ROOT_2 = 2.0 * math.pi, math.log(2.0), math.sqrt(2.0)


@njit(**FAST)
def philox(first, group, stream, key0, key1, words):
    """Words (4, BLOCK) of 32 bits for the arms from `first` on."""
    for k in range(BLOCK):
        arm = np.uint64(first) + np.uint64(k)
        c0, c1, c2, c3 = arm & WORD, arm >> HALF, np.uint64(group), np.uint64(stream)
        k0, k1 = np.uint64(key0), np.uint64(key1)
        for _ in range(10):
            p0, p1 = ROUND_0 * c0, ROUND_1 * c2
            c0, c1, c2, c3 = (p1 >> HALF) ^ c1 ^ k0, p1 & WORD, (p0 >> HALF) ^ c3 ^ k1, p0 & WORD
            k0, k1 = (k0 + WEYL_0) & WORD, (k1 + WEYL_1) & WORD
        words[0, k], words[1, k], words[2, k], words[3, k] = c0, c1, c2, c3


@njit(**FAST)
def _uniforms(first, stream, key0, key1, X, words):
    """Rows of X filled with numbers in (0, 1), each the middle of one of 2^32 cells."""
    for group in range((X.shape[0] + 3) // 4):
        philox(first, group, stream, key0, key1, words)
        for j in range(min(4, X.shape[0] - 4 * group)):
            row, word = X[4 * group + j], words[j]
            for k in range(BLOCK):
                row[k] = (np.float64(np.int64(word[k])) + 0.5) * UNIT


@njit(**FAST)
def _circle(turns, cosine, sine):
    """Cosine and sine of turns in 0 ... 1, to 1e-15. Polynomials on an eighth turn: Moshier, Cephes, sin.c (netlib)."""
    for k in range(BLOCK):
        quarter = math.floor(4.0 * turns[k] + 0.5)
        x = (turns[k] - 0.25 * quarter) * TWO_PI
        xx = x * x
        s = 1.58962301576546568060e-10 * xx - 2.50507477628578072866e-8
        s = ((s * xx + 2.75573136213857245213e-6) * xx - 1.98412698295895385996e-4) * xx + 8.33333333332211858878e-3
        s = x + x * xx * (s * xx - 1.66666666666666307295e-1)
        c = -1.13585365213876817300e-11 * xx + 2.08757008419747316778e-9
        c = ((c * xx - 2.75573141792967388112e-7) * xx + 2.48015872888517045348e-5) * xx - 1.38888888888730564116e-3
        c = 1.0 - 0.5 * xx + xx * xx * (c * xx + 4.16666666666665929218e-2)
        half = math.floor(0.5 * quarter)
        odd = quarter - 2.0 * half
        flip = 1.0 - 2.0 * (half - 2.0 * math.floor(0.5 * half))
        cosine[k], sine[k] = flip * (c - odd * (c + s)), flip * (s - odd * (s - c))


@njit(**FAST)
def _radii(u, bits, radius):
    """sqrt(-2 ln u) for u in (0, 1); `u` is spent."""
    seen = u.view(np.int64)
    exponent = radius
    for k in range(BLOCK):
        bits[k] = (seen[k] & MANTISSA) | ONE
        exponent[k] = np.float64(seen[k] >> SHIFT)
    mantissa = bits.view(np.float64)
    for k in range(BLOCK):
        m, e = mantissa[k], exponent[k] - BIAS
        high = 1.0 if m > ROOT_2 else 0.0
        m, e = m * (1.0 - 0.5 * high), e + high
        s = (m - 1.0) / (m + 1.0)
        ss = s * s  # below 0.03; ln m = 2 artanh s
        series = 1.0 / 17.0
        for term in (15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0):
            series = series * ss + 1.0 / term
        radius[k] = math.sqrt(max(-2.0 * (e * LN_2 + 2.0 * s * series), 0.0))


@njit(**FAST)
def _normal_pair(a, b, bits, scratch):
    """Two rows of uniforms made two of standard normals. Source: Box, Muller, Ann. Math. Stat. 29, 1958."""
    radius, cosine, sine = scratch[0], scratch[1], scratch[2]
    _radii(a, bits, radius)
    _circle(b, cosine, sine)
    for k in range(BLOCK):
        a[k], b[k] = radius[k] * cosine[k], radius[k] * sine[k]


@njit(**FAST)
def _by_table(row, table):
    """Quantiles of a row of uniforms, linear between nodes; table (3, CELLS + 1) middle, low end, high end."""
    for k in range(BLOCK):
        at, part = row[k] * CELLS, 0
        cell = int(at)
        if cell == 0 or cell == CELLS - 1:
            part = 1 if cell == 0 else 2
            at = (at - cell) * CELLS
            cell = int(at)
        low = table[part, cell]
        row[k] = low + (at - cell) * (table[part, cell + 1] - low)


@njit(**FAST)
def draw(first, stream, key0, key1, law, loc, scale, tables, table_of, polar, X, words, bits, scratch):
    """Columns X (column, BLOCK) of the arms from `first` on; normal ones come first and are even in number."""
    _uniforms(first, stream, key0, key1, X, words)
    for column in range(X.shape[0]):
        row = X[column]
        if law[column] == NORMAL:
            if column % 2 == 0:
                _normal_pair(row, X[column + 1], bits, scratch)
        elif law[column] == TABLE:
            _by_table(row, tables[table_of[column]])
        elif law[column] == CONSTANT:
            row[:] = 0.0
    for column in range(X.shape[0]):
        row, a, b = X[column], loc[column], scale[column]
        for k in range(BLOCK):
            row[k] = a + b * row[k]
    for pair in range(polar.shape[0]):
        size, turn, cosine, sine = X[polar[pair, 0]], X[polar[pair, 1]], scratch[0], scratch[1]
        _circle(turn, cosine, sine)
        for k in range(BLOCK):
            turn[k] = size[k] * sine[k]
            size[k] *= cosine[k]


@njit(**FAST)
def _displaced(X, slots, columns, weights, D):
    """Slots D (slot, BLOCK): the sum of columns of X by the terms (slot, column, weight)."""
    D[:, :] = 0.0
    for term in range(slots.size):
        row, add, w = D[slots[term]], X[columns[term]], weights[term]
        for k in range(BLOCK):
            row[k] += w * add[k]


@njit(**FAST)
def _jolted(D, p):
    """Points p (3, BLOCK) under Exp of a rotation vector, then a shift: D (6, BLOCK). Series good to 1 rad: 1e-12."""
    dx, dy, dz, rx, ry, rz = D[0], D[1], D[2], D[3], D[4], D[5]
    px, py, pz = p[0], p[1], p[2]
    for k in range(BLOCK):
        u, v, w, x, y, z = rx[k], ry[k], rz[k], px[k], py[k], pz[k]
        q = u * u + v * v + w * w
        a = 1.0 + q * (-1 / 6 + q * (1 / 120 + q * (-1 / 5040 + q * (1 / 362880 + q * (-1 / 39916800)))))
        b = 0.5 + q * (-1 / 24 + q * (1 / 720 + q * (-1 / 40320 + q * (1 / 3628800 + q * (-1 / 479001600)))))
        cx, cy, cz = v * z - w * y, w * x - u * z, u * y - v * x
        px[k] = x + a * cx + b * (v * cz - w * cy) + dx[k]
        py[k] = y + a * cy + b * (w * cx - u * cz) + dy[k]
        pz[k] = z + a * cz + b * (u * cy - v * cx) + dz[k]


@njit(**FAST)
def _turned(d, cosine, sine, p):
    """Points p (3, BLOCK) turned about z by an angle of this cosine and sine, and d (BLOCK,) more."""
    px, py = p[0], p[1]
    for k in range(BLOCK):
        e, x, y = d[k], px[k], py[k]
        q = e * e
        a = e * (1.0 + q * (-1 / 6 + q * (1 / 120 + q * (-1 / 5040 + q * (1 / 362880 + q * (-1 / 39916800))))))
        b = 1.0 - q * (0.5 + q * (-1 / 24 + q * (1 / 720 + q * (-1 / 40320 + q * (1 / 3628800 - q / 479001600)))))
        c, s = cosine * b - sine * a, sine * b + cosine * a
        px[k], py[k] = c * x - s * y, s * x + c * y


@njit(**FAST)
def _carried(F, p):
    """Points p (3, BLOCK) of a frame seen from where F puts it."""
    px, py, pz = p[0], p[1], p[2]
    for k in range(BLOCK):
        x, y, z = px[k], py[k], pz[k]
        px[k] = F[0, 0] * x + F[0, 1] * y + F[0, 2] * z + F[0, 3]
        py[k] = F[1, 0] * x + F[1, 1] * y + F[1, 2] * z + F[1, 3]
        pz[k] = F[2, 0] * x + F[2, 1] * y + F[2, 2] * z + F[2, 3]


@njit(**FAST)
def probe(fixed, cosine, sine, point, moved, D, p):
    """Points p (3, BLOCK) in the base: from the probe back to the base, part by part; D (7 part, BLOCK)."""
    for r in range(3):
        p[r, :] = point[r]
    for i in range(fixed.shape[0] - 1, -1, -1):
        if i < cosine.size:
            _turned(D[7 * i + 6], cosine[i], sine[i], p)
        if moved[i]:
            _jolted(D[7 * i : 7 * i + 6], p)
        _carried(fixed[i], p)


@njit(**FAST)
def errors(fixed, cosine, sine, point, moved, nominal, slots, columns, weights, X, out):
    """Probe errors out (3, arm) of columns X (column, arm), at one pose."""
    arms = X.shape[1]
    D, p, part = np.empty((7 * fixed.shape[0], BLOCK)), np.empty((3, BLOCK)), np.zeros((X.shape[0], BLOCK))
    for first in range(0, arms, BLOCK):
        count = min(BLOCK, arms - first)
        part[:, :count] = X[:, first : first + count]
        _displaced(part, slots, columns, weights, D)
        probe(fixed, cosine, sine, point, moved, D, p)
        for r in range(3):
            out[r, first : first + count] = p[r, :count] - nominal[r]


@njit(**FAST)
def _counted(p, nominal, count, first, bin_m, sums, histogram, worst):
    """Sums (10,) of x y z, xx xy xz yy yz zz, length; lengths in bins; the longest and whose it is."""
    for k in range(count):
        x, y, z = p[0, k] - nominal[0], p[1, k] - nominal[1], p[2, k] - nominal[2]
        length = math.sqrt(x * x + y * y + z * z)
        sums[0] += x
        sums[1] += y
        sums[2] += z
        sums[3] += x * x
        sums[4] += x * y
        sums[5] += x * z
        sums[6] += y * y
        sums[7] += y * z
        sums[8] += z * z
        sums[9] += length
        histogram[min(int(length / bin_m), BINS)] += 1
        if length > worst[0]:
            worst[0], worst[1] = length, first + k


@njit(**FAST)
def sample(
    first, count, keys, law, loc, scale, tables, table_of, polar, fixed, cosine, sine, point, moved, nominal,
    slots, columns, weights, bin_m, sums, histogram, worst,
):  # fmt: skip
    """Draw `count` arms from `first` on; sums (pose, 10), histogram (pose, BINS + 1), worst (pose, 2) are added to."""
    X, words, bits = np.empty((law.size, BLOCK)), np.empty((4, BLOCK), np.uint64), np.empty(BLOCK, np.int64)
    scratch, D, p = np.empty((3, BLOCK)), np.empty((7 * fixed.shape[0], BLOCK)), np.empty((3, BLOCK))
    for start in range(0, count, BLOCK):
        draw(first + start, 0, keys[0], keys[1], law, loc, scale, tables, table_of, polar, X, words, bits, scratch)
        for pose in range(cosine.shape[0]):
            _displaced(X, slots, columns, weights[pose], D)
            probe(fixed, cosine[pose], sine[pose], point, moved, D, p)
            inside = min(BLOCK, count - start)
            _counted(p, nominal[pose], inside, first + start, bin_m[pose], sums[pose], histogram[pose], worst[pose])
