"""Joint readings that bring the flange to a pose, by damped least squares on any believed arm.

Calibrated arms have no closed form. Source of the damping: Y. Nakamura, H. Hanafusa, J. Dyn. Sys. Meas. Control 108
(1986) 163.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.believed import BelievedArm
from acquisition.errors import UnreachableError

Floats = NDArray[np.float64]

MAX_STEPS = 60
STEP_RAD = 0.5
DAMPING = 1e-6
CLOSE = 1e-8  # m and rad
TABLE_M = 0.02  # neither the elbow nor a joint beyond it may come lower than this above the base plane
ELBOW = 2  # frame behind the second link


def reach(
    arm: BelievedArm, T_base_flange: Floats, near_rad: Floats, rng: np.random.Generator, starts: int = 12
) -> Floats:
    """Joint readings (joint,) that put the flange there, the first found close to `near_rad`. UnreachableError."""
    for start in _starts(near_rad, rng, starts):
        found = _solve(arm, T_base_flange, start)
        if found is None:
            continue
        q_rad = _unwound(found, near_rad, arm)
        if q_rad is not None and clear_of_table(arm, q_rad):
            return q_rad
    x, y, z = T_base_flange[:3, 3]
    raise UnreachableError(
        f"no joint position within limits puts the flange at ({x:.3f}, {y:.3f}, {z:.3f}) m with the asked-for roll "
        f"({starts} starts tried); choose another stand-off or roll, or move the fixture"
    )


def clear_of_table(arm: BelievedArm, q_rad: Floats) -> bool:
    """Whether elbow, wrist and laser stay above the base plane."""
    origin_m, _ = arm.beam(q_rad)
    return bool(np.min(arm.frames(q_rad)[ELBOW:, 2, 3]) > TABLE_M and origin_m[2] > TABLE_M)


def _starts(near_rad: Floats, rng: np.random.Generator, starts: int) -> Iterator[Floats]:
    yield near_rad
    for k in range(starts - 1):
        yield near_rad + rng.normal(0.0, 0.3 + 0.1 * k, near_rad.size)


def _solve(arm: BelievedArm, T_goal: Floats, q_rad: Floats) -> Floats | None:
    for _ in range(MAX_STEPS):
        frames = arm.frames(q_rad)
        T = frames[-1]
        turn = Rotation.from_matrix(T_goal[:3, :3] @ T[:3, :3].T).as_rotvec()
        error = np.concatenate([T_goal[:3, 3] - T[:3, 3], turn])
        if float(np.max(np.abs(error))) < CLOSE:
            return q_rad
        axes = frames[:-1, :3, 2]
        levers_m = np.asarray(np.cross(axes, T[:3, 3] - frames[:-1, :3, 3]), dtype=np.float64)
        J = np.concatenate([levers_m, axes], axis=1).T
        step = J.T @ np.asarray(np.linalg.solve(J @ J.T + DAMPING * np.eye(6), error), dtype=np.float64)
        q_rad = q_rad + step * min(1.0, STEP_RAD / float(np.max(np.abs(step))))
    return None


def _unwound(q_rad: Floats, near_rad: Floats, arm: BelievedArm) -> Floats | None:
    """The same pose with every joint in the turn nearest to `near_rad` that its range allows; None where none does."""
    turns = 2.0 * np.pi * np.round((near_rad - q_rad) / (2.0 * np.pi))
    q_rad = q_rad + turns
    q_rad = np.where(q_rad > arm.upper_rad, q_rad - 2.0 * np.pi, q_rad)
    q_rad = np.where(q_rad < arm.lower_rad, q_rad + 2.0 * np.pi, q_rad)
    inside = np.all(q_rad >= arm.lower_rad) and np.all(q_rad <= arm.upper_rad)
    return q_rad if inside else None
