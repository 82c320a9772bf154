"""Orientations of a target in a frame that nobody needs to state: the turning half of a full pose."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.least_distance import weights
from calibrate.blunders.rough_fit import turn_between
from calibrate.blunders.witness import Otherwise, Strain

Floats = NDArray[np.float64]

COLUMNS = "columns rx_rad, ry_rad, rz_rad"
FEWEST_POSES = 12  # two rotations have six unknowns
LEVER_M = 0.2  # an angle counts by what it moves at this distance: a hand's length
TURNS = 10  # compared are factors, not digits


@dataclass(frozen=True)
class OrientationWitness:
    """R_device_target = A R_base_flange X with unknown rotations A of the device and X of the target's mount."""

    q_rad: Floats  # (pose, joint)
    rotation_rad: Floats  # (pose, 3) rotation vectors as written

    def strain(self, T_base_flange: Floats) -> Strain:
        """A and X as mean rotations in turn, from the start that the turns between poses give."""
        flange, seen = T_base_flange[:, :3, :3], Rotation.from_rotvec(self.rotation_rad).as_matrix()
        device = turn_between(_turns(flange), _turns(seen), np.ones(len(seen) - 1))  # their axes differ by A
        weight, angle = np.ones(len(seen)), np.zeros(len(seen))
        for _ in range(TURNS):
            mount = _nearest(np.einsum("n,nji,njk->ik", weight, device @ flange, seen))
            device = _nearest(np.einsum("n,nij,nkj->ik", weight, seen, flange @ mount))
            apart = np.linalg.norm(device @ flange @ mount - seen, axis=(1, 2))
            angle = 2.0 * np.arcsin(np.minimum(apart / np.sqrt(8.0), 1.0))
            weight = weights(angle)
        return Strain(LEVER_M * float(np.median(angle)), 0.0)

    def otherwise(self) -> Iterator[Otherwise]:
        """Degrees, and the orientation of the device in the target instead of the other way round."""
        yield Otherwise(
            BlunderKind.DEGREES,
            COLUMNS,
            "rotation vectors in degrees",
            "write radians (degrees times pi/180)",
            replace(self, rotation_rad=np.radians(self.rotation_rad)),
        )
        yield Otherwise(
            BlunderKind.INVERTED_ROTATION,
            COLUMNS,
            "rotation vectors of the device in the target's axes",
            "change the sign of all three columns: they lead from the device to the target",
            replace(self, rotation_rad=-self.rotation_rad),
        )


def _turns(R: Floats) -> Floats:
    """(pose - 1, 3) rotation vectors from each of these (pose, 3, 3) to the next."""
    return Rotation.from_matrix(R[1:] @ np.swapaxes(R[:-1], 1, 2)).as_rotvec()


def _nearest(matrix: Floats) -> Floats:
    """The rotation (3, 3) nearest to a weighted sum of rotations: their mean (Moakher, SIAM J. Matrix Anal. 24)."""
    U, _, Vt = np.linalg.svd(matrix)
    return np.asarray(U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt, dtype=np.float64)
