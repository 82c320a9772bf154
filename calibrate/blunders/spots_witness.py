"""Two spots on the faces of a dual PSD are one line of light in the fixture; the laser's line has to lie on it.

The first spot is a point of the line, and the second, mirrored at the first face, gives its direction: no reflection
has to be computed for an arm that points elsewhere. Rotation of a fixture by Kabsch over directions, its shift by
least squares over distances point to line.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.least_distance import weights
from calibrate.blunders.rough_fit import turn_between
from calibrate.blunders.witness import Otherwise, Strain

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FEWEST_POSES = 12  # of one placement: four numbers each, six unknowns
TURNS = 10
DAMPING = 1e-6  # of the mean square of a column: along lines all alike a fixture stays where it is believed
LEVER_M = 0.3  # a turned fixture counts by what it moves at this distance: the usual travel of the beam


@dataclass(frozen=True)
class SpotsWitness:
    """Every fixture's place is found; it should not have to be far from where it is believed."""

    q_rad: Floats  # (pose, joint)
    spots_m: Floats  # (pose, 4) x, y on PSD 1, x, y on PSD 2
    placement: Ints  # (pose,)
    first_psd: Ints  # (pose,) 1 or 2
    T_psd1_psd2: Floats  # (4, 4)
    T_base_psd1: Mapping[int, Floats]
    origin_m: Floats  # (3,) of the laser in the flange frame
    direction: Floats  # (3,) unit

    def strain(self, T_base_flange: Floats) -> Strain:
        beam = T_base_flange[:, :3, :3] @ self.direction
        origin = T_base_flange[:, :3, :3] @ self.origin_m + T_base_flange[:, :3, 3]
        near, far = self._line()
        distance, moved = np.zeros(len(beam)), []
        for place in np.unique(self.placement):
            rows = self.placement == place
            found = _placed(near[rows], far[rows], origin[rows], beam[rows], self.T_base_psd1[int(place)])
            distance[rows] = found[0]
            moved.append(found[1])
        return Strain(float(np.median(distance)), float(np.median(moved)))

    def otherwise(self) -> Iterator[Otherwise]:
        """Detectors exchanged in the order of the light, and millimetres. Mirrored axes: spot_signs.py."""
        yield Otherwise(
            BlunderKind.EXCHANGED_PSD,
            "column first_psd",
            "the beam strikes the other detector first",
            "write 1 for 2 and 2 for 1",
            replace(self, first_psd=3 - self.first_psd),
        )
        yield Otherwise(
            BlunderKind.MILLIMETRES,
            "columns psd1_x_m, psd1_y_m, psd2_x_m, psd2_y_m",
            "spots in millimetres",
            "write metres (millimetres times 0.001)",
            replace(self, spots_m=1e-3 * self.spots_m),
        )

    def _line(self) -> tuple[Floats, Floats]:
        """(pose, 3), (pose, 3) first spot, and the second as the incoming beam would strike it unreflected; PSD 1."""
        flat = np.zeros((len(self.spots_m), 2, 3))
        flat[:, :, :2] = self.spots_m.reshape(-1, 2, 2)
        R, t = self.T_psd1_psd2[:3, :3], self.T_psd1_psd2[:3, 3]
        on_face = flat[:, 0], flat[:, 1] @ R.T + t
        first = (self.first_psd == 1)[:, None]
        near, far = np.where(first, on_face[0], on_face[1]), np.where(first, on_face[1], on_face[0])
        normal = np.where(first, [0.0, 0.0, 1.0], R[:, 2])
        return near, far - 2.0 * np.sum((far - near) * normal, axis=1, keepdims=True) * normal


def _placed(near: Floats, far: Floats, origin: Floats, beam: Floats, believed: Floats) -> tuple[Floats, float]:
    """(distance (pose,), moved m) of one fixture: mean distance of both points of each line from the laser's line."""
    weight, distance = np.ones(len(near)), np.zeros(len(near))
    turn, shift = believed[:3, :3], believed[:3, 3]
    along = far - near
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = np.eye(3) - beam[:, :, None] * beam[:, None, :]
    for _ in range(TURNS):
        turn = turn_between(along, beam, weight)
        points = np.stack([near @ turn.T, far @ turn.T], axis=1)
        normal = 2.0 * np.einsum("n,nij->ij", weight, across)
        ridge = DAMPING * np.trace(normal) / 3.0
        pull = np.einsum("n,nij,nkj->i", weight, across, origin[:, None] - points)
        shift = np.linalg.solve(normal + ridge * np.eye(3), pull + ridge * believed[:3, 3])
        off = np.einsum("nij,nkj->nki", across, points + shift - origin[:, None])
        distance = np.linalg.norm(off, axis=2).mean(axis=1)
        weight = weights(distance)
    turned = float(Rotation.from_matrix(turn @ believed[:3, :3].T).magnitude())
    return distance, float(np.linalg.norm(shift - believed[:3, 3])) + LEVER_M * turned
