"""The measuring arm as believed, for guidance: where the probe is, and postures that bring it somewhere."""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.parameters import start_values
from calibrate.rigid import cross_matrix

Floats = NDArray[np.float64]
STEPS = 40
LARGEST_STEP_RAD = 0.5
DAMPING = 1e-6  # of squared lengths, m
ARRIVED_M = 1e-6  # far below what a person can do


class BelievedGuidedArm:
    """Implements acquisition.guided.arm.GuidedArm on the rig's arm as drawn."""

    def __init__(self, rig: Rig) -> None:
        self._arm = arm_of(rig)
        self._theta = start_values(self._arm.parameters)
        self._point_m = np.array(rig.tool.point_m or (0.0, 0.0, 0.0))
        self.lower_rad = np.array([joint.lower_rad for joint in rig.arm.joints])
        self.upper_rad = np.array([joint.upper_rad for joint in rig.arm.joints])

    def tip_m(self, q_rad: Floats) -> Floats:
        T_base_flange = self._arm.flange(self._theta, q_rad)
        return T_base_flange[:, :3, :3] @ self._point_m + T_base_flange[:, :3, 3]

    def postures(self, start_rad: Floats, point_m: Floats) -> Floats:
        """Damped least squares with a limited step (Wampler, IEEE Trans. SMC 16, 1986), all starts at once."""
        q_rad = start_rad.copy()
        for _ in range(STEPS):
            tip_m = self.tip_m(q_rad)
            miss_m = point_m - tip_m
            if np.abs(miss_m).max() < ARRIVED_M:
                break
            twists = self._arm.joint_twists(self._theta, q_rad)
            slope = twists[:, :3] - cross_matrix(tip_m) @ twists[:, 3:]
            square = slope @ np.swapaxes(slope, 1, 2) + DAMPING * np.eye(3)
            move_rad = np.einsum("rij,ri->rj", slope, np.linalg.solve(square, miss_m[..., np.newaxis])[..., 0])
            largest_rad = np.abs(move_rad).max(axis=1, keepdims=True)
            q_rad = q_rad + move_rad * np.minimum(1.0, LARGEST_STEP_RAD / np.maximum(largest_rad, 1e-300))
        arrived = np.linalg.norm(self.tip_m(q_rad) - point_m, axis=1) < 10.0 * ARRIVED_M
        within = np.all((q_rad >= self.lower_rad) & (q_rad <= self.upper_rad), axis=1)
        return q_rad[arrived & within]
