"""How far a drive winds up: what the measured torque does between the motor's and the second encoder of a joint.

    second - first = level + c torque + l speed (+ a sin q + b cos q) + noise

c is the compliance of what is between the two (harmonic drive, gear train: Spong, Robot Dynamics and Control, 1989,
section 6.6), l what friction in front of it takes from a motor's torque, or a lag of the joint's own, which no motion
separates; a disc mounted off its centre adds one turn of sine (Bai, Teo, IEEE/ASME Trans. Mechatronics 7, 2002), which
over a short way resembles the torque of gravity: it is always allowed for, at the size that discs have.

Sigmas are those of whole blocks of time, and so is the proof: neighbouring samples are no two witnesses.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.clock import RobustLine, fit
from calibrate.diagnose.streams.track import Outcome, Track

FEWEST_BLOCKS = 5  # of time, beside the numbers that are fitted
FOLDS = 20  # stretches of the motion that are left out in turn; one for each block takes minutes for a long recording
Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Deflection:
    """One joint (from 1); its numbers None where the motion does not show them. Angles of unseen blocks, rms."""

    joint: int
    outcome: Outcome
    compliance: float | None = None  # rad/Nm, whichever way the two encoders count
    sigma: float | None = None
    p: float = 1.0
    unseen_before_rad: float = float("nan")
    unseen_after_rad: float = float("nan")
    friction_may_lag: bool = False  # what follows the speed is no more than friction can take from the torque


def deflections(second: Track, first: Track, torque: Track) -> tuple[Deflection, ...]:
    """Of every joint of `second` whose torque (Nm at the joint) was measured; all on one clock, same joints in both."""
    second = second.read()
    q_rad, speed = first.curve.at(second.time_s), first.curve.rate(second.time_s)
    seconds = (second.time_s - second.time_s[:1].sum()) / (limits.BLOCK_S * limits.BLOCKS_TOGETHER)
    block = np.floor(seconds).astype(np.intp)
    out: list[Deflection] = []
    for channel in range(second.channels):
        joint = second.joint(channel)
        at = next((k for k in range(torque.channels) if torque.joint(k) == joint), None)
        if at is None:
            continue
        torque_nm = torque.of([at]).curve.at(second.time_s)[:, 0]
        columns = np.stack([torque_nm, speed[:, channel], np.sin(q_rad[:, channel]), np.cos(q_rad[:, channel])], axis=1)
        parted = second.values[:, channel] - q_rad[:, channel]
        good = np.all(np.isfinite(columns), axis=1) & np.isfinite(parted)
        out.append(_of_joint(joint, columns[good], parted[good], block[good], second.channels))
    return tuple(out)


def _of_joint(joint: int, columns: Floats, parted: Floats, block: Ints, joints: int) -> Deflection:
    """`columns` (row, 4): torque, speed, sine and cosine of the angle. `joints`: how many are tested."""
    if len(np.unique(block)) <= FEWEST_BLOCKS or np.ptp(columns[:, 0]) == 0.0:
        return Deflection(joint, Outcome.NOT_DETERMINABLE)
    line = _fitted(columns, parted, block)
    before, after = (_unseen(some, parted, block) for some in (columns[:, 1:], columns))
    if line is None or before is None or after is None or not np.all(np.isfinite(line.sigma)):
        return Deflection(joint, Outcome.NOT_DETERMINABLE)
    value, sigma = float(line.values[0]), float(line.sigma[0])
    p = min(1.0, joints * 2.0 * float(stdtr(len(np.unique(block)) - 1, -abs(value) / max(sigma, 1e-300))))
    by_torque, by_speed = (abs(line.values[k]) * columns[:, k].std() for k in (0, 1))
    return Deflection(
        joint,
        Outcome.FOUND if after < before and p < limits.DEFLECTION_ALPHA else Outcome.ABSENT,
        abs(value),
        sigma,
        p,
        before,
        after,
        friction_may_lag=bool(by_speed <= by_torque),
    )


def _fitted(columns: Floats, parted: Floats, block: Ints) -> RobustLine | None:
    """Of columns (row, k), those of the disc last, and a level. What is assumed of the disc counts as two more blocks,
    each as much as a block of the data: their samples hang together.
    """
    X = np.column_stack([columns, np.ones(len(parted))])
    rough = fit(X[:, [*range(columns.shape[1] - 2), -1]], parted, block)
    if rough is None:
        return None
    left = parted - X[:, [*range(columns.shape[1] - 2), -1]] @ rough.values
    assumed = np.zeros((2, X.shape[1]))
    weight = float(left.std()) * np.sqrt(len(parted) / len(np.unique(block))) / limits.USUAL_DISC_RAD
    assumed[(0, 1), (-3, -2)] = weight
    blocks = np.append(block, [block.max() + 1, block.max() + 2])
    return fit(np.concatenate([X, assumed]), np.concatenate([parted, np.zeros(2)]), blocks)


def _unseen(columns: Floats, parted: Floats, block: Ints) -> float | None:
    """Rms that fits to the others leave in each of FOLDS stretches of blocks; None where they do not determine it."""
    squares: list[float] = []
    numbers, at = np.unique(block, return_inverse=True)
    part = at * FOLDS // max(len(numbers), FOLDS)
    for one in np.unique(part):
        seen = part != one
        line = _fitted(columns[seen], parted[seen], block[seen])
        if line is None:
            return None
        left = parted[~seen] - np.column_stack([columns[~seen], np.ones(int((~seen).sum()))]) @ line.values
        squares.append(float(np.mean(left**2)))
    return float(np.sqrt(np.mean(squares)))
