"""Forward and inverse kinematics of the real tool, as a model has it with its physics, for programs that compute.

The inverse is that of `corrected.commanded`; nothing follows from the order of the poses, so that many poses at a time
give what each gives alone. A pose without joints is an error; what limits
the others is in notes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.apply.correct.corrected import (
    CLOSE,
    MOST_POSES,
    Arms,
    Inverse,
    Options,
    Wanted,
    as_samples,
    commanded,
    near_singular,
    refuse_beyond,
    wanted_joints,
)
from calibrate.apply.predicting import flange_with_physics
from calibrate.errors import DataError
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]
Notes = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ToolKinematics:
    """Of one model and tool; kept, since how the flange lies takes most of a second to work out."""

    arms: Arms
    options: Options

    def forward(self, q_rad: Floats, conditions: Mapping[str, Floats]) -> tuple[Floats, Notes]:
        """T_base_tool (pose, 4, 4), m, at joint readings (pose, joint), rad, under columns of samples.csv, (pose,)
        each; sentences on conditions that are missing or beyond their recorded range. DataError where an effect cannot
        be evaluated, or joints are of another shape or not finite.
        """
        T, applied = flange_with_physics(self.arms.model, as_samples(self._checked(q_rad), conditions))
        beyond = [
            f"{_row(k)}: beyond the calibrated range: {names}" for k, names in enumerate(applied.outside) if names
        ]
        return T @ self.arms.real_tool, (*applied.notes, *_first(beyond))

    def nominal(self, q_rad: Floats) -> Floats:
        """T_base_tool (pose, 4, 4), m, of the rig file's arm: where a controller or planner with it has the tool."""
        return wanted_joints(self.arms, self._checked(q_rad))

    def _checked(self, q_rad: Floats) -> Floats:
        n = self.arms.n_joints
        if q_rad.ndim != 2 or q_rad.shape[1] != n or not np.isfinite(q_rad).all():
            raise DataError(f"joint angles of shape {q_rad.shape}: give (pose, {n}) or ({n},), all finite, in rad")
        return q_rad

    def inverse(self, wanted: Wanted, inverse_of: Inverse) -> tuple[Floats, Notes]:
        """(pose, joint), rad, at which `forward` is at the wanted poses within `CLOSE` (m and rad).

        Notes as of `forward`, of singular postures, and of poses that an effect which jumps does not let it reach.
        DataError for poses without joints, with the reason of the first of them.
        """
        if len(wanted) > MOST_POSES:
            raise DataError(f"{len(wanted)} poses; at most {MOST_POSES} are solved at a time, split them into parts")
        found = commanded(self.arms, wanted, inverse_of, self.options)
        refuse_beyond(self.arms, found.q_rad, None, found.why)
        if found.why:
            row = min(found.why)
            more = f" (and {len(found.why) - 1} more of {len(wanted)} poses)" if len(found.why) > 1 else ""
            raise DataError(
                f"{_row(row)}: {found.why[row][1]}{more}; move the pose, or give the posture near which it is wanted"
            )
        there, notes = self.forward(found.q_rad, found.conditions)
        left_m, left_rad = _off(there, wanted.T_base_tool)
        off_m, off_rad = _off(self.forward(found.nominal_rad, found.conditions)[0], wanted.T_base_tool)
        far_m = np.maximum(np.abs(wanted.T_base_tool[:, :3, 3]).max(axis=1), 0.1)
        singular = near_singular(found.q_rad - found.nominal_rad, off_rad + off_m / far_m)
        near = [f"{_row(k)}: {says}" for k, says in enumerate(singular) if says]
        jumps = [
            f"{_row(k)}: an effect of the model jumps there; the tool is {1e6 * left_m[k]:.2g} µm and "
            f"{1e6 * left_rad[k]:.2g} µrad from the pose"
            for k in np.flatnonzero(np.maximum(left_m, left_rad) > CLOSE).tolist()
        ]
        return found.q_rad, (*notes, *_first(near), *_first(jumps))


def _off(T: Floats, wanted: Floats) -> tuple[Floats, Floats]:
    """(pose,) distance in m and turn in rad of poses (pose, 4, 4) from the wanted ones."""
    apart = inverse(T) @ wanted
    return np.linalg.norm(apart[:, :3, 3], axis=1), Rotation.from_matrix(apart[:, :3, :3]).magnitude()


def _row(k: int) -> str:
    return f"pose [{k}]"


def _first(notes: list[str]) -> Notes:
    """The first, with how many there are: a thousand poses give one sentence."""
    return (notes[0] + (f" (and {len(notes) - 1} more poses)" if len(notes) > 1 else ""),) if notes else ()
