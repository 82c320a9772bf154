"""Both ends of a bar of known length."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.least_distance import least_distance
from calibrate.blunders.witness import Otherwise, Strain

Floats = NDArray[np.float64]

FEWEST_PAIRS = 15  # one number each; the target has three unknowns


@dataclass(frozen=True)
class BarWitness:
    """The target is found; a drawn one should not have to move."""

    q_rad: Floats  # (2 pair, joint) all ends a, then all ends b
    length_m: Floats  # (pair,)
    point_m: Floats | None  # (3,) target as drawn in the flange frame

    def strain(self, T_base_flange: Floats) -> Strain:
        a, b = np.split(T_base_flange, 2)
        turns, apart = b[:, :3, :3] - a[:, :3, :3], b[:, :3, 3] - a[:, :3, 3]
        drawn = np.zeros(3) if self.point_m is None else self.point_m

        def rows(shift: Floats) -> tuple[Floats, Floats]:
            span = turns @ (drawn + shift) + apart
            length = np.maximum(np.linalg.norm(span, axis=1), 1e-9)
            return length - self.length_m, np.einsum("ni,nij->nj", span / length[:, None], turns)

        shift, distance = least_distance(rows, np.zeros(3))
        return Strain(float(np.median(distance)), 0.0 if self.point_m is None else float(np.linalg.norm(shift)))

    def otherwise(self) -> Iterator[Otherwise]:
        """The length stands in the rig, not in the samples."""
        yield from ()
