"""The robot's own base frame: the one that lies best on the arm itself, wherever in the world the arm stands.

A device of unknown place does not show where the base is, nor a first joint how the base is turned beside its zero. As
in the predicted error of free space (uncertainty/free_space.py) such a motion of everything is no error of the arm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.predict import Predictor
from calibrate.rigid import cross_matrix, inverse, transform

Floats = NDArray[np.float64]

POSTURES = 500  # the motion that lies best settles to about 2 %
SEED = 1  # of the postures: the same model always has the same frame


@dataclass(frozen=True, eq=False)
class OwnFrame:
    """Of a model at its values: the tip at postures drawn evenly within the limits of the joints."""

    known: Predictor
    q_rad: Floats  # (posture, joint)
    tip_m: Floats  # (posture, 3)
    twist: Floats  # (6, 3 posture) motion that lies best on displacements of the tip
    T_base_flange: Floats  # (posture, 4, 4)

    @classmethod
    def of(cls, predictor: Predictor) -> "OwnFrame":
        joints = predictor.rig.arm.joints
        low, high = np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints])
        q_rad = np.random.default_rng(SEED).uniform(low, high, (POSTURES, len(joints)))
        flange = predictor.flange(q_rad)
        tip_m = predictor.tip_at(flange)
        rigid = np.concatenate([np.tile(np.eye(3), (POSTURES, 1, 1)), -cross_matrix(tip_m)], axis=2)
        pinv = np.asarray(np.linalg.pinv(rigid.reshape(-1, 6)), dtype=np.float64)
        return cls(predictor, q_rad, tip_m, pinv, flange)

    def back(self, other: Predictor) -> Floats:
        """(4, 4) that brings the arm at values near the known ones best onto the known one, to first order."""
        if other is self.known:
            return np.eye(4)
        v = self.twist @ (other.tip_m(self.q_rad) - self.tip_m).ravel()
        return transform(-v[:3], -v[3:])

    def flange_back(self, other: Predictor, back: Floats) -> Floats:
        """(4, 4) in the flange that brings it best onto the known one, behind `back` of the same values.

        A target does not show where the flange is that it is mounted on, nor a last joint how it is turned beside its
        zero: such a constant motion is no error of the arm, either.
        """
        if other is self.known:
            return np.eye(4)
        return mean_motion(back @ other.flange(self.q_rad), self.T_base_flange)


def mean_motion(T_from: Floats, T_to: Floats) -> Floats:
    """(4, 4) C with T_from C nearest to T_to (pose, 4, 4): the mean turn, and the mean shift seen from the first frame.

    Source of the mean turn: M. Moakher, Means and averaging in the group of rotations, SIAM J. Matrix Anal. Appl. 24
    (2002) 1: the orthogonal matrix nearest to the sum.
    """
    between = inverse(T_from) @ T_to
    out = np.eye(4)
    out[:3, :3] = Rotation.from_matrix(between[:, :3, :3]).mean().as_matrix()
    out[:3, 3] = between[:, :3, 3].mean(axis=0)
    return out
