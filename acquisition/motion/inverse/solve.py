"""Joint readings for wanted flange poses, or places of a point, on any arm, many at a time: damped Newton steps.

`Solver` is an arm with all that this needs: the nearest posture for a pose, and one branch kept on a way.
Source of the damping: T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE
Trans. Robotics 27 (2011) 984: the damping is the squared error itself, so the last steps are Newton's.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import UnreachableError
from acquisition.motion.inverse.closed_form import Starts
from acquisition.motion.kinematics import Kinematics, by_readings, flange, jacobian, rotation_vector

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

CLOSE = 1e-10  # m and rad: a tenth of what is promised, thousands of times the rounding of a 1 m arm
MAX_STEPS = 40
STEP_RAD = 0.5  # longest step of one joint: half of where a linear picture of an arm still means something
SMALL_TURN_RAD = 1e-3  # here half the skew part is the turn to 2e-10 of itself, and far cheaper than the exact vector
SAME_RAD = 1e-6  # solutions nearer than this are one
ALL_RANDOM_STARTS = 128  # to list solutions: eight branches, each found with all but certainty


@dataclass(frozen=True, eq=False)
class Solved:
    """`q_rad` (pose, joint), NaN where not `found` (pose,)."""

    q_rad: Floats
    found: NDArray[np.bool_]


class Goal(Protocol):
    """What postures have to bring about; `rows` states which of them `frames` (pose, joint + 1, 4, 4) are."""

    def missing(self, frames: Floats, rows: Rows) -> Floats:
        """(pose, k) what is left, m and rad."""
        ...

    def by_joint(self, frames: Floats) -> Floats:
        """(pose, k, joint)"""
        ...


@dataclass(frozen=True, eq=False)
class AtPose:
    """The flange stands at `T_base_flange` (pose, 4, 4)."""

    T_base_flange: Floats

    def missing(self, frames: Floats, rows: Rows) -> Floats:
        return _error(self.T_base_flange[rows], frames[:, -1])

    def by_joint(self, frames: Floats) -> Floats:
        return jacobian(frames)


@dataclass(frozen=True, eq=False)
class AtPoint:
    """A point of the flange (3,) is at a point of the base (3,); how the flange is turned is of no matter."""

    in_flange_m: Floats
    in_base_m: Floats

    def missing(self, frames: Floats, rows: Rows) -> Floats:
        return self.in_base_m - self._place_m(frames)

    def by_joint(self, frames: Floats) -> Floats:
        return jacobian(frames, self._place_m(frames))[:, :3]

    def _place_m(self, frames: Floats) -> Floats:
        return frames[:, -1, :3, :3] @ self.in_flange_m + frames[:, -1, :3, 3]


def refine(arm: Kinematics, goal: Goal, start_rad: Floats, max_steps: int = MAX_STEPS, close: float = CLOSE) -> Solved:
    """From one start (pose, joint) each, until within `close` (m and rad); joint limits are not looked at."""
    q_rad, found = start_rad.copy(), np.zeros(len(start_rad), dtype=bool)
    active = np.arange(len(start_rad))
    for _ in range(max_steps + 1):
        frames = arm.frames(q_rad[active])
        error = goal.missing(frames, active)
        size = np.max(np.abs(error), axis=1)
        found[active[size < close]] = True
        going = np.isfinite(size) & (size >= close)
        active, error, frames = active[going], error[going], frames[going]
        if active.size == 0:
            break
        step = _step(by_readings(arm, goal.by_joint(frames)), error)
        q_rad[active] += step * np.minimum(1.0, STEP_RAD / np.max(np.abs(step), axis=1, keepdims=True))
    return Solved(np.where(found[:, None], q_rad, np.nan), found)


def all_solutions(
    arm: Kinematics, T_base_flange: Floats, near_rad: Floats, starts: Starts | None, rng: np.random.Generator
) -> Floats:
    """Every solution (solution, joint) for one pose (4, 4) within the joint range, nearest to `near_rad` first.

    Each stands in the turns nearest to `near_rad`. Without a closed form: those that random starts lead to.
    """
    if starts is None:
        begin = rng.uniform(arm.lower_rad, arm.upper_rad, (ALL_RANDOM_STARTS, arm.lower_rad.size))
    else:
        begin = starts(T_base_flange[None])[0]
    begin = np.concatenate([begin, near_rad[None]])
    begin = begin[np.all(np.isfinite(begin), axis=1)]
    solved = refine(arm, AtPose(np.broadcast_to(T_base_flange, (len(begin), 4, 4))), begin)
    q_rad = unwound(solved.q_rad[solved.found], near_rad[None], arm)
    q_rad = q_rad[within(arm, q_rad)]
    q_rad = q_rad[np.argsort(np.linalg.norm(q_rad - near_rad, axis=1), kind="stable")]
    out: list[Floats] = []
    for q in q_rad:
        if all(np.max(np.abs((q - other + np.pi) % (2.0 * np.pi) - np.pi)) > SAME_RAD for other in out):
            out.append(q)
    return np.array(out).reshape(-1, arm.lower_rad.size)


def unwound(q_rad: Floats, near_rad: Floats, arm: Kinematics) -> Floats:
    """(..., joint) the same postures, every joint in the turn nearest to `near_rad` that its range allows."""
    q = q_rad + 2.0 * np.pi * np.round((near_rad - q_rad) / (2.0 * np.pi))
    q = np.where(q > arm.upper_rad, q - 2.0 * np.pi, q)
    return np.where(q < arm.lower_rad, q + 2.0 * np.pi, q)


def within(arm: Kinematics, q_rad: Floats) -> NDArray[np.bool_]:
    """(...) whether every joint (..., joint) is in its range."""
    return np.asarray(np.all((q_rad >= arm.lower_rad) & (q_rad <= arm.upper_rad), axis=-1))


def _step(J: Floats, error: Floats) -> Floats:
    """(pose, joint); square arms by their own equations, others by the damped normal equations of the short side."""
    damping = np.sum(error**2, axis=1)[:, None, None] + 1e-15
    short, one = J @ np.swapaxes(J, 1, 2), np.eye(J.shape[1])
    small = damping[:, 0, 0] < 1e-12
    out = np.empty((len(J), J.shape[2]))
    square = J.shape[1] == J.shape[2]
    newton = small & square
    if newton.any():
        out[newton] = _solved(J[newton] + 1e-13 * one, error[newton])
    rest = ~newton
    if rest.any():
        weights = _solved(short[rest] + damping[rest] * one, error[rest])
        out[rest] = (np.swapaxes(J[rest], 1, 2) @ weights[..., None])[..., 0]
    return out


def _solved(A: Floats, b: Floats) -> Floats:
    return np.asarray(np.linalg.solve(A, b[..., None])[..., 0], dtype=np.float64)


def _error(T_goal: Floats, T: Floats) -> Floats:
    """(pose, 6) shift m and turn rad in the base that are missing; exact also half a turn away."""
    turn = T_goal[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)
    out = np.empty((len(T), 6))
    out[:, :3] = T_goal[:, :3, 3] - T[:, :3, 3]
    out[:, 3] = 0.5 * (turn[:, 2, 1] - turn[:, 1, 2])
    out[:, 4] = 0.5 * (turn[:, 0, 2] - turn[:, 2, 0])
    out[:, 5] = 0.5 * (turn[:, 1, 0] - turn[:, 0, 1])
    far = np.einsum("pii->p", turn) < 3.0 - SMALL_TURN_RAD**2
    if far.any():
        out[far, 3:] = rotation_vector(turn[far])
    return out


KEPT_CLOSE = 1e-13  # m and rad; accelerations are read off differences of such solutions some ms apart
JUMP_RAD = 0.5  # a solution further from the one before is another branch; set-points are milliseconds apart
LEVER_M = 0.3  # makes metres and radians of the Jacobian comparable: about the length of a link


@dataclass(frozen=True, eq=False)
class Solver:
    """`starts`: the closed form of the nominal arm, None where it has none; random starts come from `seed`."""

    arm: Kinematics
    starts: Starts | None = None
    seed: int = 1

    def flange(self, q_rad: Floats) -> Floats:
        """T_base_flange (4, 4) at joint readings (joint,)."""
        return flange(self.arm, q_rad)

    def nearest(self, T_base_flange: Floats, near_rad: Floats) -> Floats:
        """The posture (joint,) within the joint range with the shortest way from `near_rad`. UnreachableError."""
        rng = np.random.default_rng(self.seed)
        found = all_solutions(self.arm, T_base_flange, near_rad, self.starts, rng)
        if len(found):
            return found[0]
        x, y, z = T_base_flange[:3, 3]
        raise UnreachableError(
            f"no joint position within limits puts the flange at ({x:.3f}, {y:.3f}, {z:.3f}) m as asked; "
            + self._why(T_base_flange, near_rad)
        )

    def kept(self, T_base_flange: Floats, near_rad: Floats) -> Floats:
        """The posture (joint,) of the branch of `near_rad`, which must be near; limits are not looked at.

        UnreachableError where there is none near: beyond reach, or the branches meet there.
        """
        solved = refine(self.arm, AtPose(T_base_flange[None]), near_rad[None], close=KEPT_CLOSE)
        if solved.found[0] and float(np.max(np.abs(solved.q_rad[0] - near_rad))) < JUMP_RAD:
            return solved.q_rad[0]
        joint, worth = self.weakest(near_rad)
        x, y, z = T_base_flange[:3, 3]
        raise UnreachableError(
            f"the flange cannot go on straight at ({x:.3f}, {y:.3f}, {z:.3f}) m: joint {joint} hardly moves the flange "
            f"(least singular value {worth:.4f}); the pose is out of reach, or two branches meet there"
        )

    def weakest(self, q_rad: Floats) -> tuple[int, float]:
        """The joint (1...) that moves most without moving the flange, and the Jacobian's least singular value.

        Rows of the Jacobian are m by LEVER_M, and rad.
        """
        J = by_readings(self.arm, jacobian(self.arm.frames(q_rad[None])))[0]
        _, sizes, rows = np.linalg.svd(J / np.repeat([LEVER_M, 1.0], 3)[:, None])
        return int(np.argmax(np.abs(rows[len(sizes) - 1]))) + 1, float(sizes[-1])

    def _why(self, T_base_flange: Floats, near_rad: Floats) -> str:
        """Whether a posture exists at all, and which joint's range it would leave."""
        begin = near_rad[None] if self.starts is None else self.starts(T_base_flange[None])[0]
        begin = begin[np.all(np.isfinite(begin), axis=1)]
        solved = refine(self.arm, AtPose(np.broadcast_to(T_base_flange, (len(begin), 4, 4))), begin)
        q_rad = solved.q_rad[solved.found]
        q_rad = q_rad[~within(self.arm, q_rad)]
        if len(q_rad) == 0:
            return "it is out of reach: move the target nearer"
        beyond = np.maximum(self.arm.lower_rad - q_rad, q_rad - self.arm.upper_rad)
        best = int(np.argmin(np.max(beyond, axis=1)))
        joint = int(np.argmax(beyond[best]))
        return (
            f"joint {joint + 1} would stand at {np.degrees(q_rad[best, joint]):.1f}°, outside its range "
            f"{np.degrees(self.arm.lower_rad[joint]):.1f} to {np.degrees(self.arm.upper_rad[joint]):.1f}°"
        )
