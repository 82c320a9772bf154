"""Performance figures of ISO 9283:1998 from attained poses, each with one sigma of its scatter.

Pose accuracy AP (7.2.1), pose repeatability RP (7.2.2), multi-directional pose accuracy variation vAP (7.2.3), distance
accuracy AD and repeatability RD (7.3), drift of AP and RP (7.6). Which of this is confirmed by public sources and which
only from memory of the standard: docs/iso9283.md.

One sigma is a jackknife over cycles (B. Efron, C. Stein, The jackknife estimate of variance, Annals of Statistics 9
(1981) 586): how far the figure would scatter in another test of as many cycles. What all cycles share, as a wrong
frame of the device, is not in it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.iso9283.cube import FAR_PAIR

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SPREAD = 3.0  # standard deviations in every repeatability of the standard
SET = 10  # cycles of one point of a drift curve
MOST_PARTS = 1000  # that are left out in turn: sigma is known to 2 %; the standard asks for 30 cycles
FEWEST = 3  # cycles of a pose: with two, a scatter has no sigma


@dataclass(frozen=True)
class Performance:
    """One figure with one sigma, m or rad; sigma is NaN with fewer than `FEWEST` cycles."""

    value: float
    sigma: float


@dataclass(frozen=True, eq=False)
class AttainedPoses:
    """What was commanded and where the tool stood, row by row in time, all in the base of the robot."""

    pose: Ints  # (row,) number of the commanded pose, from 1
    side: Ints  # (row,) number of the approach: rows of one number came from one side; -1: not known
    t_s: Floats  # (row,)
    command_m: Floats  # (row, 3)
    attained_m: Floats  # (row, 3)
    turn_rad: Floats | None  # (row, 3) rotation vector from the commanded to the attained orientation

    def of(self, pose: int, side: int | None = None) -> "AttainedPoses":
        """Rows of one pose; of one side: also those whose side is not known."""
        keep = self.pose == pose
        if side is not None:
            keep &= (self.side == side) | (self.side == -1)
        return self.take(keep)

    def take(self, rows: NDArray[np.bool_] | slice) -> "AttainedPoses":
        turn = None if self.turn_rad is None else self.turn_rad[rows]
        return AttainedPoses(
            self.pose[rows], self.side[rows], self.t_s[rows], self.command_m[rows], self.attained_m[rows], turn
        )

    def __len__(self) -> int:
        return len(self.pose)


@dataclass(frozen=True)
class PosePerformance:
    """Of one pose, by the cycles of its most frequent approach."""

    pose: int
    cycles: int
    accuracy_m: Performance  # AP
    repeatability_m: Performance  # RP
    turn_rad: tuple[Performance, ...]  # AP_a, AP_b, AP_c about x, y, z of the base; empty: not measured
    turn_repeatability_rad: tuple[Performance, ...]  # RP_a, RP_b, RP_c, each as the half width of ±3 S
    variation_m: Performance | None  # vAP; None: one approach only
    sides: int  # approaches with at least two cycles


@dataclass(frozen=True)
class DistancePerformance:
    """Between two poses, one distance a cycle."""

    poses: tuple[int, int]
    cycles: int
    command_m: float
    accuracy_m: Performance  # AD, attained less commanded
    repeatability_m: Performance  # RD, the half width of ±3 S


@dataclass(frozen=True)
class DriftPerformance:
    """Of one pose, over sets of `SET` cycles; the first set is what the others are compared with."""

    pose: int
    after_s: tuple[float, ...]  # of each set since the first
    accuracy_m: tuple[float, ...]  # AP of each set
    repeatability_m: tuple[float, ...]
    dap_m: Performance  # dAP: the largest difference of AP
    drp_m: Performance  # dRP
    moved_m: Performance  # the largest way of the barycentre, which AP sees only as far as it lies along its error


@dataclass(frozen=True)
class PoseTest:
    """All figures of one test; `distance`, `drift` None: the cycles do not show them."""

    poses: tuple[PosePerformance, ...]
    distance: DistancePerformance | None
    drift: DriftPerformance | None


def performance_of(attained: AttainedPoses) -> PoseTest:
    """The figures of every pose that was attained at least twice from one side; there may be none."""
    numbers = [int(n) for n in np.unique(attained.pose) if len(attained.of(int(n), _main_side(attained, int(n)))) > 1]
    poses = tuple(_of_pose(attained, number) for number in numbers)
    return PoseTest(poses, _distance(attained, numbers), _drift(attained, numbers[0]) if numbers else None)


def pose_accuracy(attained_m: Floats, command_m: Floats) -> float:
    """AP: distance of the barycentre of attained positions (cycle, 3) from that of the commanded ones."""
    return float(np.linalg.norm(np.mean(attained_m, axis=0) - np.mean(command_m, axis=0)))


def pose_repeatability(attained_m: Floats) -> float:
    """RP: mean distance from the barycentre plus three standard deviations of these distances, n - 1; NaN of one."""
    if len(attained_m) < 2:
        return float("nan")
    off_m = np.linalg.norm(attained_m - np.mean(attained_m, axis=0), axis=1)
    return float(np.mean(off_m) + SPREAD * np.std(off_m, ddof=1))


def pose_accuracy_variation(*attained_m: Floats) -> float:
    """vAP: the largest distance between barycentres (cycle, 3) of two approaches."""
    centres = np.array([np.mean(one, axis=0) for one in attained_m])
    return float(np.max(np.linalg.norm(centres[:, None] - centres[None], axis=2)))


def distance_accuracy(one_m: Floats, other_m: Floats, command_m: float) -> float:
    """AD: mean attained distance of pairs (cycle, 3) less the commanded one."""
    return float(np.mean(np.linalg.norm(one_m - other_m, axis=1)) - command_m)


def distance_repeatability(one_m: Floats, other_m: Floats) -> float:
    """RD: three standard deviations of the attained distances, n - 1; NaN of one."""
    return three_deviations(np.linalg.norm(one_m - other_m, axis=1))


def mean_angle(values: Floats) -> float:
    """AP of an angle: mean (cycle,) of its deviations from the command, with its sign."""
    return float(np.mean(values))


def three_deviations(values: Floats) -> float:
    """Three standard deviations of (cycle,), n - 1: RP of an angle; NaN of one."""
    return float(SPREAD * np.std(values, ddof=1)) if len(values) > 1 else float("nan")


def _of_pose(attained: AttainedPoses, number: int) -> PosePerformance:
    main = attained.of(number, _main_side(attained, number))
    sides = [attained.take((attained.pose == number) & (attained.side == s)) for s in _sides(attained, number)]
    turns = () if main.turn_rad is None else tuple(main.turn_rad.T)
    return PosePerformance(
        number,
        len(main),
        jackknifed(pose_accuracy, [np.stack([main.attained_m, main.command_m], axis=1)], _pairs),
        jackknifed(pose_repeatability, [main.attained_m]),
        tuple(jackknifed(mean_angle, [turn]) for turn in turns),
        tuple(jackknifed(three_deviations, [turn]) for turn in turns),
        jackknifed(pose_accuracy_variation, [one.attained_m for one in sides]) if len(sides) > 1 else None,
        len(sides),
    )


def _pairs(rows: Floats) -> tuple[Floats, ...]:
    """The columns of (cycle, column, 3) that belong together."""
    return tuple(np.swapaxes(rows, 0, 1))


def _sides(attained: AttainedPoses, number: int) -> list[int]:
    """Known approaches of a pose with at least two cycles, the most frequent first, and of these the earliest."""
    sides, first, cycles = np.unique(attained.side[attained.pose == number], return_index=True, return_counts=True)
    order = np.lexsort((first, -cycles))
    return [int(sides[i]) for i in order if sides[i] >= 0 and cycles[i] > 1]


def _main_side(attained: AttainedPoses, number: int) -> int | None:
    return next(iter(_sides(attained, number)), None)


def _distance(attained: AttainedPoses, numbers: Sequence[int]) -> DistancePerformance | None:
    """Between the poses of the standard; without these, between the two that are farthest apart."""
    if len(numbers) < 2:
        return None
    main = {number: attained.of(number, _main_side(attained, number)) for number in numbers}
    pair = FAR_PAIR if set(FAR_PAIR) <= main.keys() else _farthest(main)
    one, other = (main[number] for number in pair)
    cycles = min(len(one), len(other))
    command_m = float(np.linalg.norm(one.command_m.mean(axis=0) - other.command_m.mean(axis=0)))
    rows = np.stack([one.attained_m[:cycles], other.attained_m[:cycles]], axis=1)

    def off(a: Floats, b: Floats) -> float:
        return distance_accuracy(a, b, command_m)

    return DistancePerformance(
        pair, cycles, command_m, jackknifed(off, [rows], _pairs), jackknifed(distance_repeatability, [rows], _pairs)
    )


def _farthest(main: dict[int, AttainedPoses]) -> tuple[int, int]:
    pairs = [(a, b) for a in main for b in main if a < b]
    return max(
        pairs,
        key=lambda p: float(np.linalg.norm(main[p[0]].command_m.mean(axis=0) - main[p[1]].command_m.mean(axis=0))),
    )


def _drift(attained: AttainedPoses, number: int) -> DriftPerformance | None:
    """None with fewer than two sets."""
    main = attained.of(number, _main_side(attained, number))
    sets = [main.take(slice(start, start + SET)) for start in range(0, len(main) - SET + 1, SET)]
    if len(sets) < 2:
        return None
    accuracy = tuple(pose_accuracy(one.attained_m, one.command_m) for one in sets)
    repeatability = tuple(pose_repeatability(one.attained_m) for one in sets)
    commanded = bool(np.isfinite(main.command_m).all())
    error_m = [one.attained_m - (one.command_m if commanded else 0.0) for one in sets]

    def largest(way: Callable[[Floats, Floats], float]) -> Performance:
        """Of all sets, against the first one; of positions alone where no command is known."""
        return max((jackknifed(way, [error_m[0], late]) for late in error_m[1:]), key=lambda one: one.value)

    return DriftPerformance(
        number,
        tuple(float(np.mean(one.t_s) - np.mean(sets[0].t_s)) for one in sets),
        accuracy,
        repeatability,
        largest(_accuracy_apart) if commanded else Performance(float("nan"), float("nan")),
        largest(_repeatability_apart),
        largest(_barycentres_apart),
    )


def _accuracy_apart(one_m: Floats, other_m: Floats) -> float:
    return abs(_length_of_mean(one_m) - _length_of_mean(other_m))


def _repeatability_apart(one_m: Floats, other_m: Floats) -> float:
    return abs(pose_repeatability(one_m) - pose_repeatability(other_m))


def _barycentres_apart(one_m: Floats, other_m: Floats) -> float:
    return float(np.linalg.norm(np.mean(one_m, axis=0) - np.mean(other_m, axis=0)))


def _length_of_mean(error_m: Floats) -> float:
    return float(np.linalg.norm(np.mean(error_m, axis=0)))


def _whole(rows: Floats) -> tuple[Floats, ...]:
    return (rows,)


def jackknifed(
    figure: Callable[..., float], sets: Sequence[Floats], columns: Callable[[Floats], tuple[Floats, ...]] = _whole
) -> Performance:
    """The figure of independent sets (cycle, ...), with one sigma by leaving out one part after the other.

    A part is one cycle, or of more than `MOST_PARTS` cycles every so many-th (delete-d jackknife of groups): each takes
    the figure of all the others.

    `columns` makes the arguments of a set: several where rows of them belong together.
    """

    def at(given: Sequence[Floats]) -> float:
        return figure(*(argument for one in given for argument in columns(one)))

    variance = 0.0
    for which, one in enumerate(sets):
        n = len(one)
        if n < FEWEST:
            return Performance(at(sets), float("nan"))
        parts = min(n, MOST_PARTS)
        left = (np.delete(one, slice(k, None, parts), axis=0) for k in range(parts))
        without = np.array([at([*sets[:which], rest, *sets[which + 1 :]]) for rest in left])
        variance += (parts - 1) / parts * float(np.sum((without - without.mean()) ** 2))
    return Performance(at(sets), float(np.sqrt(variance)))
