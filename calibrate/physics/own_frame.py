"""The robot's own base frame: the one that lies best on the arm itself, wherever in the world the arm stands.

A device of unknown place does not show where the base is, nor a first joint how the base is turned beside its zero. As
in the predicted error of free space (uncertainty/free_space.py) such a motion of everything is no error of the arm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.predict import Predictor
from calibrate.rigid import cross_matrix, transform

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

    @classmethod
    def of(cls, predictor: Predictor) -> "OwnFrame":
        joints = predictor.rig.arm.joints
        low, high = np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints])
        q_rad = np.random.default_rng(SEED).uniform(low, high, (POSTURES, len(joints)))
        tip_m = predictor.tip_m(q_rad)
        rigid = np.concatenate([np.tile(np.eye(3), (POSTURES, 1, 1)), -cross_matrix(tip_m)], axis=2)
        return cls(predictor, q_rad, tip_m, np.asarray(np.linalg.pinv(rigid.reshape(-1, 6)), dtype=np.float64))

    def back(self, other: Predictor) -> Floats:
        """(4, 4) that brings the arm at values near the known ones best onto the known one, to first order."""
        if other is self.known:
            return np.eye(4)
        v = self.twist @ (other.tip_m(self.q_rad) - self.tip_m).ravel()
        return transform(-v[:3], -v[3:])
