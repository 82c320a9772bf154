"""Positions of a target in a frame that nobody needs to state: tracker, camera, coordinate measuring machine."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.rough_fit import rough_fit
from calibrate.blunders.witness import Otherwise, Strain

Floats = NDArray[np.float64]

COLUMNS = "columns x_m, y_m, z_m"
FEWEST_POSES = 12  # a frame and a target have nine unknowns
MILLIMETRES = 1e-3


@dataclass(frozen=True)
class PositionWitness:
    """Frame and target are found; a drawn target should not have to move."""

    q_rad: Floats  # (pose, joint)
    position_m: Floats  # (pose, 3)
    point_m: Floats | None  # (3,) target as drawn in the flange frame
    mirrored: bool = False

    def strain(self, T_base_flange: Floats) -> Strain:
        drawn = self.point_m
        start = np.zeros(3) if drawn is None else drawn
        found = rough_fit(T_base_flange, self.position_m, start, mirrored=self.mirrored)
        return Strain(found.typical_m, 0.0 if drawn is None else float(np.linalg.norm(found.point_m - drawn)))

    def otherwise(self) -> Iterator[Otherwise]:
        """Columns that mirror the readings (one sign, or two of them exchanged; which is open), and millimetres.

        No instrument is left-handed: conventions.py looks for joint signs first.
        """
        yield Otherwise(
            BlunderKind.MIRRORED_AXIS,
            COLUMNS,
            "only the mirror image of the readings fits the arm (determinant -1), and no instrument is left-handed",
            "change the sign of one of these columns, or exchange two, as the device's export shows",
            replace(self, mirrored=not self.mirrored),
        )
        yield Otherwise(
            BlunderKind.MILLIMETRES,
            COLUMNS,
            "positions in millimetres",
            "write metres (millimetres times 0.001)",
            replace(self, position_m=MILLIMETRES * self.position_m),
        )
