"""Wire lengths from a drum whose place is stated or not."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.least_distance import least_distance
from calibrate.blunders.witness import Otherwise, Strain

Floats = NDArray[np.float64]

FEWEST_POSES = 30  # one number each; drum and target have six unknowns


@dataclass(frozen=True)
class WireWitness:
    """Drum and target are found, from trilateration and from where the rig says; a drawn target should not move."""

    q_rad: Floats  # (pose, joint)
    length_m: Floats  # (pose,)
    point_m: Floats | None  # (3,) target as drawn in the flange frame
    drum_m: Floats | None  # (3,) as the rig says, in the base

    def strain(self, T_base_flange: Floats) -> Strain:
        R, t = T_base_flange[:, :3, :3], T_base_flange[:, :3, 3]
        drawn = np.zeros(3) if self.point_m is None else self.point_m

        def rows(x: Floats) -> tuple[Floats, Floats]:
            span = R @ (drawn + x[:3]) + t - x[3:]
            length = np.maximum(np.linalg.norm(span, axis=1), 1e-9)
            along = span / length[:, None]
            return length - self.length_m, np.concatenate([np.einsum("ni,nij->nj", along, R), -along], axis=1)

        tips = R @ drawn + t
        starts = [_trilaterated(tips, self.length_m), *([] if self.drum_m is None else [self.drum_m])]
        ends = [least_distance(rows, np.concatenate([np.zeros(3), drum])) for drum in starts]
        x, distance = min(ends, key=lambda end: float(np.sum(end[1])))
        return Strain(float(np.median(distance)), 0.0 if self.point_m is None else float(np.linalg.norm(x[:3])))

    def otherwise(self) -> Iterator[Otherwise]:
        """Millimetres."""
        remedy = "write metres (millimetres times 0.001)"
        converted = replace(self, length_m=1e-3 * self.length_m)
        yield Otherwise(BlunderKind.MILLIMETRES, "column wire_m", "lengths in millimetres", remedy, converted)


def _trilaterated(points_m: Floats, lengths_m: Floats) -> Floats:
    """(3,) as calibrate.alignment.trilaterate, but an answer for every hypothesis, also of points in a plane."""
    p = points_m - points_m.mean(axis=0)
    square = np.sum(p**2, axis=1) - lengths_m**2
    origin = np.linalg.lstsq(2.0 * p, square - square.mean(), rcond=1e-6)[0]
    return np.asarray(origin + points_m.mean(axis=0), dtype=np.float64)
