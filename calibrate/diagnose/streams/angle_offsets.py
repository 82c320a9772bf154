"""The part that stays between two readings of one angle: set-point and reading, or the two encoders of a joint.

    reading - other = offset + steps + droop G(q) + l speed + c acceleration + f sense + what is left

G is the torque of gravity on unit masses at the ends of the links, or one turn of sine of the joint's own angle: a
position loop without integral action hangs below its set-point in proportion to that torque, and a soft drive turns
between its encoders by it (Spong, Robot Dynamics and Control, 1989, section 6.6). Everything is a mean over intervals
of time, sigmas are those of blocks of them that are left out in turn. An offset counts where it is far beyond its sigma
and beyond what nothing explains, since a servo that follows badly leaves some of everything.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.clock import RobustLine, fit
from calibrate.diagnose.streams.following import course_of
from calibrate.diagnose.streams.track import Outcome, Track
from calibrate.model.effects.term import Size

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
GravityLevers = Callable[[Floats], Floats]  # (row, joint) rad to (row, joint): torque of gravity on unit masses

INTERVALS = 200  # of time, over which everything is averaged; of fewer rows as many as give four rows each
FEWEST = 80  # rows
BLOCKS = 40  # of time that are left out in turn, for the sigma
REACHES = 1.1  # of the largest difference, up to which a level is no extrapolation
FOLDS = 4  # stretches of time that are left out in turn, for the proof of a droop
EDGE = 8  # intervals on either side of a step
FLAT = 1e-9  # of a column: rounding
TURN_RAD = 2.0 * np.pi


@dataclass(frozen=True)
class OffsetStretch:
    """The offset from one step to the next; `found`: beyond what noise and the rest of the difference leave."""

    from_s: float
    to_s: float
    offset: Size
    found: bool


@dataclass(frozen=True)
class AngleOffset:
    """One joint (from 1): reading less the other. `why`: the reason where nothing is determined, else empty.

    `zeroless`: the zero of the reading is not known, so that only a change and a droop are findings. `droop`: half the
    swing over the recorded poses of what follows gravity (`by_gravity`) or the joint's own angle once a turn.
    `zero_rad`: what a known zero took off every offset. `steady`: one level over the whole recording, without a slip.
    `limit_rad`: the smallest offset, or change of it, that would have been found.
    """

    joint: int
    outcome: Outcome
    stretches: tuple[OffsetStretch, ...] = ()
    droop: Size | None = None
    by_gravity: bool = False
    zeroless: bool = False
    limit_rad: float | None = None
    why: str = ""
    zero_rad: float = 0.0
    steady: bool = True

    def known(self, *, stepped: bool, bent: bool) -> "AngleOffset":
        """Of two encoders: without what a slip or a measured torque explains, and what a disc off its centre may do."""
        stretches = self.stretches[:1] if stepped or self.outcome is not Outcome.FOUND else self.stretches
        usual = limits.OFFSET_SIGMAS * limits.USUAL_DISC_RAD
        stretches = tuple(replace(s, found=s.found and abs(s.offset.value) > usual) for s in stretches)
        droop = None if self.droop is None or bent or self.droop.value < usual else self.droop
        found = droop is not None or len(stretches) > 1 or any(one.found for one in stretches)
        outcome = self.outcome if self.why else Outcome.FOUND if found else Outcome.ABSENT
        steady = not stepped and len(stretches) == 1
        return replace(self, outcome=outcome, stretches=stretches, droop=droop, steady=steady)


def angle_offsets(
    reading: Track,
    other: Track,
    levers: GravityLevers | None = None,
    *,
    zeros_rad: Sequence[float | None] = (),
    wraps: bool,
) -> tuple[AngleOffset, ...]:
    """Of every channel of `reading` against the same joint of `other`, both on one clock.

    `wraps`: the reading is absolute within one turn, may count against the joint, and shows `zeros_rad` (one a channel)
    where the joint is at zero; None, or none at all: not known.
    """
    reading, joints = reading.read(), [reading.joint(c) for c in range(reading.channels)]
    at, speed, bend = course_of(other, reading.time_s)
    rows = np.all(np.isfinite(at) & np.isfinite(speed) & np.isfinite(bend), axis=1)
    if np.count_nonzero(rows) < FEWEST:
        why = f"only {np.count_nonzero(rows)} rows in which both were read, of at least {FEWEST}"
        return tuple(AngleOffset(joint, Outcome.NOT_DETERMINABLE, why=why) for joint in joints)
    values, q = reading.values[rows], at[rows]
    if max(np.ptp(values, axis=0).max(), np.ptp(q, axis=0).max()) < limits.STANDS_RAD:
        return tuple(AngleOffset(joint, Outcome.NOT_DETERMINABLE, why="no joint moves") for joint in joints)
    torque = None if levers is None else levers(q)
    out = list[AngleOffset]()
    for c, joint in enumerate(joints):
        v = speed[rows, c]
        moved = np.stack([v, bend[rows, c], np.sign(v) * (np.abs(v) > limits.SLOWEST_RAD_S)], axis=1)
        gravity = None if torque is None else torque[:, joint - 1]
        difference, why = _difference(values[:, c], q[:, c], wraps=wraps)
        if why:
            out.append(AngleOffset(joint, Outcome.NOT_DETERMINABLE, why=why))
            continue
        means = _averaged(reading.time_s[rows], difference, q[:, c], moved, gravity)
        zero_rad = (zeros_rad[c] if zeros_rad else None) if wraps else 0.0
        out.append(_judged(joint, means, zero_rad, wraps=wraps))
    return tuple(out)


def _difference(values: Floats, q: Floats, *, wraps: bool) -> tuple[Floats, str]:
    """(row,) reading less the other, and why there is none. Of a reading that wraps modulo a turn about its middle."""
    if (np.ptp(values) == 0.0) != (np.ptp(q) == 0.0) and max(np.ptp(values), np.ptp(q)) > limits.STANDS_RAD:
        return values, "one of the two readings never changes while the other one does"
    if not wraps:
        return values - q, ""
    turns = (np.unwrap(values) - values.mean()) @ (q - q.mean())
    difference = values - (1.0 if turns >= 0.0 else -1.0) * q
    middle = float(np.angle(np.mean(np.exp(1j * difference))))
    difference = middle + (difference - middle + np.pi) % TURN_RAD - np.pi
    unlike = float(np.std(difference)) > max(limits.UNLIKE * float(np.std(q)), limits.STANDS_RAD)
    return difference, "the second reading does not follow the joint one to one" if unlike else ""


@dataclass(frozen=True, eq=False)
class _Means:
    """Over intervals of time: (interval,) each, `ends_s` (interval, 2), `moved` (interval, 3)."""

    ends_s: Floats
    difference: Floats
    moved: Floats  # speed, acceleration, and the sense of motion, by which dry friction holds a joint back
    angle: Floats
    turned: Floats  # (interval, 2) its sine and cosine
    gravity: Floats | None

    @property
    def block(self) -> Ints:
        return np.arange(len(self.difference)) * BLOCKS // len(self.difference)

    def columns(self) -> list[Floats]:
        """A level, and speed, acceleration and sense where the joint moves."""
        return [np.ones(len(self.difference)), *(c for c in self.moved.T if np.ptp(c) > FLAT)]

    def droops(self) -> list[tuple[bool, list[Floats]]]:
        """Columns of what may follow gravity, and whether they are its torque; none where it does not turn."""
        heavy = self.gravity is None or np.ptp(self.gravity) > FLAT
        found = [] if self.gravity is None or not heavy else [(True, [self.gravity])]
        if heavy and np.ptp(self.angle) > limits.OFFSET_TURN_RAD:
            found.append((False, list(self.turned.T)))
        return found


def _averaged(time_s: Floats, difference: Floats, q: Floats, moved: Floats, gravity: Floats | None) -> _Means:
    parts = np.array_split(np.arange(len(time_s)), min(INTERVALS, len(time_s) // 4))

    def mean(values: Floats) -> Floats:
        return np.array([values[rows].mean(axis=0) for rows in parts])

    ends_s = np.array([[time_s[rows[0]], time_s[rows[-1]]] for rows in parts])
    turned = np.stack([np.sin(q), np.cos(q)], axis=1)
    return _Means(
        ends_s, mean(difference), mean(moved), mean(q), mean(turned), None if gravity is None else mean(gravity)
    )


@dataclass(frozen=True, eq=False)
class _Fit:
    """Columns, a level first, and steps behind intervals; `left`: rms of the means that they do not explain, `moved`:
    rms of what goes with the motion.
    """

    steps: tuple[int, ...]
    line: RobustLine
    left: float
    moved: float

    def least(self, sigma: float) -> float:
        """The smallest size of this sigma that counts."""
        beside = max(limits.OFFSET_BEYOND_LEFT * self.left, limits.OFFSET_BEYOND_MOTION * self.moved)
        return max(limits.OFFSET_SIGMAS * sigma, beside, limits.FINEST_RAD)


def _fitted(means: _Means, columns: list[Floats]) -> _Fit | None:
    """Each step takes away most of what is left without it. None where time does not determine the columns."""
    found = _with_steps(means, columns, ())
    while found is not None and len(found.steps) < limits.MOST_SLIPS:
        place = _best_step(means, columns, found.steps)
        more = None if place is None else _with_steps(means, columns, tuple(sorted((*found.steps, place))))
        if place is None or more is None or more.left > limits.OFFSET_LEAVES * found.left:
            break
        at = more.steps.index(place) - len(more.steps)
        if abs(more.line.values[at]) < more.least(float(more.line.sigma[at])):
            break
        found = more
    return found


def _with_steps(means: _Means, columns: list[Floats], steps: tuple[int, ...]) -> _Fit | None:
    X = np.stack([*columns, *(_step(means, place) for place in steps)], axis=1)
    try:
        line = fit(X, means.difference, means.block)
    except np.linalg.LinAlgError:  # a block that alone determines a column
        return None
    if line is None or not np.all(np.isfinite(line.covariance)):
        return None
    moving = slice(1, len(means.columns()))
    moved = X[:, moving] @ line.values[moving]
    return _Fit(steps, line, _rms(means.difference - X @ line.values), _rms(moved - moved.mean()))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _step(means: _Means, place: int) -> Floats:
    return (np.arange(len(means.difference)) >= place).astype(float)


def _best_step(means: _Means, columns: list[Floats], steps: tuple[int, ...]) -> int | None:
    """The interval before which one more step takes away most squares, clear of the ends and of other steps."""
    U = orth(np.stack([*columns, *(_step(means, place) for place in steps)], axis=1))
    left = means.difference - U @ (U.T @ means.difference)
    ends, best, most = np.array([0, *steps, len(left)]), None, 0.0
    for place in range(len(left)):
        if np.min(np.abs(ends - place)) < EDGE:
            continue
        step = _step(means, place)
        step -= U @ (U.T @ step)
        squares = float(step @ left) ** 2 / max(float(step @ step), FLAT)
        best, most = (place, squares) if squares > most else (best, most)
    return best


def _judged(joint: int, means: _Means, zero_rad: float | None, *, wraps: bool) -> AngleOffset:
    """With a droop where it takes away most of what is left without one, in unseen stretches, too."""
    plain = means.columns()
    found = _fitted(means, plain)
    if found is None:
        return AngleOffset(joint, Outcome.NOT_DETERMINABLE, why="its blocks of time do not determine an offset")
    found = _beside_a_disc(means, found) if wraps else found
    droop, by_gravity = None, False
    for torque, columns in means.droops():
        other = _fitted(means, [*plain, *columns])
        size = None if other is None else _swing(other, columns, len(plain))
        if other is None or size is None or other.left > limits.OFFSET_LEAVES * found.left:
            continue
        if abs(other.line.values[0]) > REACHES * np.abs(means.difference).max():
            continue  # a level that no pose has shown: what the two share is not separated
        if _unseen(means, [*plain, *columns], other.steps) < limits.OFFSET_LEAVES * _unseen(means, plain, other.steps):
            found, droop, by_gravity = other, size, torque
    stretches = _stretches(means, found, zero_rad, wraps=wraps)
    decided = droop is not None or len(stretches) > 1 or any(one.found for one in stretches)
    limit_rad = max(found.least(one.offset.sigma) for one in stretches)
    outcome = Outcome.FOUND if decided else Outcome.ABSENT
    zeroless, steady = zero_rad is None, len(stretches) == 1
    return AngleOffset(
        joint, outcome, stretches, droop, by_gravity, zeroless, limit_rad, zero_rad=zero_rad or 0.0, steady=steady
    )


def _beside_a_disc(means: _Means, found: _Fit) -> _Fit:
    """Without steps that a disc off its centre explains as well, since an arm that goes from place to place shows such
    a disc as levels. It is judged at every joint that moves, however short its way is.
    """
    if not found.steps or np.ptp(means.angle) < limits.STANDS_RAD:
        return found
    plain = means.columns()
    disc = _fitted(means, [*plain, *means.turned.T])
    level = None if disc is None or disc.steps else _with_steps(means, plain, ())
    return found if level is None else level


def _unseen(means: _Means, columns: list[Floats], steps: tuple[int, ...]) -> float:
    """Rms that fits to the other stretches leave in each of FOLDS; the steps are taken out by the fit to all."""
    whole = _with_steps(means, columns, steps)
    if whole is None:
        return float("inf")
    stepped = sum((v * _step(means, k) for v, k in zip(whole.line.values[len(columns) :], steps, strict=True)), 0.0)
    X, y = np.stack(columns, axis=1), means.difference - stepped
    fold, left = np.arange(len(y)) * FOLDS // len(y), np.empty(len(y))
    for one in range(FOLDS):
        left[fold == one] = (y - X @ np.linalg.lstsq(X[fold != one], y[fold != one], rcond=None)[0])[fold == one]
    return _rms(left)


def _swing(found: _Fit, columns: list[Floats], first: int) -> Size | None:
    """Half the swing of columns from `first` on; None where it is not beyond its sigma and what is left."""
    which = slice(first, first + len(columns))
    values, covariance = found.line.values[which], found.line.covariance[which, which]
    curve = np.stack(columns, axis=1)
    high, low = (curve[pick(curve @ values)] for pick in (np.argmax, np.argmin))
    along = 0.5 * (high - low)
    size, sigma = float(along @ values), float(np.sqrt(along @ covariance @ along))
    return Size(size, sigma) if size > found.least(sigma) else None


def _stretches(means: _Means, found: _Fit, zero_rad: float | None, *, wraps: bool) -> tuple[OffsetStretch, ...]:
    """The level, with the steps that came before; about the zero where one is known."""
    n, steps = len(found.line.values) - len(found.steps), found.steps
    begins = [float(means.ends_s[0, 0]), *(float(means.ends_s[k, 0]) for k in steps), float(means.ends_s[-1, 1])]
    out = list[OffsetStretch]()
    for k, (from_s, to_s) in enumerate(pairwise(begins)):
        counted = np.zeros(len(found.line.values))
        counted[0] = 1.0
        counted[n : n + k] = 1.0
        offset = float(counted @ found.line.values) - (zero_rad or 0.0)
        offset = (offset + np.pi) % TURN_RAD - np.pi if wraps else offset
        sigma = float(np.sqrt(counted @ found.line.covariance @ counted))
        beyond = zero_rad is not None and bool(abs(offset) > found.least(sigma))
        out.append(OffsetStretch(from_s, to_s, Size(offset, sigma), beyond))
    return tuple(out)
