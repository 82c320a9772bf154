"""The typed face of the compiled loops of the error simulation: drawn arms, and the errors of their probes.

An arm is fixed parts F_0 ... F_n with turns about z between them. Slot 7 i + c (c = 0 ... 5) jolts part i by a shift
and a rotation vector in the frame behind it, slot 7 i + 6 adds to the angle of joint i + 1: p = F_0 E_0 Rz(q_1 + d_1)
F_1 E_1 ... F_n E_n p_probe. Columns are what is drawn of an arm; at a pose a slot is a sum of columns by weights.
There is no numpy twin: where numba's cache is cold (ready.py) the first call compiles for some seconds.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PER_PART = 7
NORMAL, UNIFORM, TABLE, CONSTANT = range(4)  # laws of a column, as in perturbed_loops.py
CELLS, BINS = 1024, 512
TAIL = 2.0**-33  # half a cell of a random word: what lies beyond is never drawn
SUMS = 10  # x y z, xx xy xz yy yz zz, length


@dataclass(frozen=True)
class DrawnColumns:
    """What is drawn of every arm. Normal columns stand first and are even in number, which `of` sees to."""

    law: Ints  # (column,)
    loc: Floats
    scale: Floats
    tables: Floats  # (table, 3, CELLS + 1) quantiles: middle, low end, high end
    table_of: Ints  # (column,)
    polar: Ints  # (pair, 2) columns of a size and a turn, which become size times cosine and sine


@dataclass(frozen=True)
class ArmAtPoses:
    """The nominal arm at some poses, and the weights of columns in slots there."""

    fixed: Floats  # (joint + 1, 4, 4)
    angle_rad: Floats  # (pose, joint), offsets added
    point_m: Floats  # (3,) of the probe behind the last part
    slots: Ints  # (term,)
    columns: Ints  # (term,)
    weights: Floats  # (pose, term)

    @property
    def moved(self) -> NDArray[np.bool_]:
        """(part,) whether any term jolts it."""
        out = np.zeros(len(self.fixed), dtype=np.bool_)
        out[self.slots[self.slots % PER_PART < PER_PART - 1] // PER_PART] = True
        return out

    def nominal_m(self) -> Floats:
        """(pose, 3) where the probe is without any error, by the same loops."""
        nothing = np.zeros((1, 1))
        none = ArmAtPoses(
            self.fixed, self.angle_rad, self.point_m, self.slots[:0], self.columns[:0], self.weights[:, :0]
        )
        return np.stack([probe_errors(none, pose, nothing, np.zeros(3))[0] for pose in range(len(self.angle_rad))])


@dataclass(frozen=True)
class Counted:
    """Sums over drawn arms; two of them add up to that of all their arms."""

    arms: int
    sums: Floats  # (pose, SUMS)
    histogram: Ints  # (pose, BINS + 1) of error lengths, the last bin for what is longer
    worst_m: Floats  # (pose,)
    worst_arm: Ints  # (pose,) its number

    def plus(self, other: "Counted") -> "Counted":
        """Of equally bad arms the first one is told."""
        longer = other.worst_m > self.worst_m
        return Counted(
            self.arms + other.arms,
            self.sums + other.sums,
            self.histogram + other.histogram,
            np.where(longer, other.worst_m, self.worst_m),
            np.where(longer, other.worst_arm, self.worst_arm),
        )


def probe_errors(arm: ArmAtPoses, pose: int, columns: Floats, nominal_m: Floats) -> Floats:
    """(arm, 3) m of given columns (arm, column), at one of the poses."""
    from calibrate.kernels import perturbed_loops as loops

    angle, out = arm.angle_rad[pose], np.empty((3, len(columns)))
    X = np.ascontiguousarray(columns.T)
    place = arm.fixed, np.cos(angle), np.sin(angle), arm.point_m, arm.moved, nominal_m
    loops.errors(*place, arm.slots, arm.columns, arm.weights[pose], X, out)
    return out.T


def count_arms(
    arm: ArmAtPoses, drawn: DrawnColumns, nominal_m: Floats, bin_m: Floats, first: int, count: int, seed: int
) -> Counted:
    """Arms number `first` to `first + count` of a seed (64 bits), at all poses; bins (pose,) of the histograms."""
    from calibrate.kernels import perturbed_loops as loops

    poses = len(arm.angle_rad)
    sums, histogram = np.zeros((poses, SUMS)), np.zeros((poses, BINS + 1), dtype=np.int64)
    worst = np.zeros((poses, 2))
    columns = drawn.law, drawn.loc, drawn.scale, drawn.tables, drawn.table_of, drawn.polar
    place = arm.fixed, np.cos(arm.angle_rad), np.sin(arm.angle_rad), arm.point_m, arm.moved, nominal_m
    terms = arm.slots, arm.columns, arm.weights, bin_m
    loops.sample(first, count, _keys(seed), *columns, *place, *terms, sums, histogram, worst)
    return Counted(count, sums, histogram, worst[:, 0].copy(), worst[:, 1].astype(np.int64))


def draw_block(drawn: DrawnColumns, first: int, seed: int) -> Floats:
    """(arm, column) of the block of arms from `first` on, as they are drawn."""
    from calibrate.kernels import perturbed_loops as loops

    X, scratch = np.empty((len(drawn.law), loops.BLOCK)), np.empty((3, loops.BLOCK))
    words, bits, keys = np.empty((4, loops.BLOCK), np.uint64), np.empty(loops.BLOCK, np.int64), _keys(seed)
    columns = drawn.law, drawn.loc, drawn.scale, drawn.tables, drawn.table_of, drawn.polar
    loops.draw(first, 0, keys[0], keys[1], *columns, X, words, bits, scratch)
    return X.T.copy()


def _keys(seed: int) -> NDArray[np.uint64]:
    return np.array([seed & 0xFFFFFFFF, (seed >> 32) & 0xFFFFFFFF], dtype=np.uint64)
