"""An arm with all that its inverse kinematics need: the nearest posture for a pose, and one branch kept on a way."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import UnreachableError
from acquisition.motion.inverse.closed_form import Starts
from acquisition.motion.inverse.kinematics import Kinematics, by_readings, flange, jacobian
from acquisition.motion.inverse.solve import AtPose, all_solutions, refine, within

Floats = NDArray[np.float64]

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
            f"the flange cannot go on straight at ({x:.3f}, {y:.3f}, {z:.3f}) m: joint {joint} has lost its grip "
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
            f"joint {joint + 1} would stand at {np.degrees(q_rad[best, joint]):.1f} deg, outside its range "
            f"{np.degrees(self.arm.lower_rad[joint]):.1f} to {np.degrees(self.arm.upper_rad[joint]):.1f} deg"
        )
