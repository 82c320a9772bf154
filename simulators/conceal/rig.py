"""A whole rig in numbers: the arm, what hangs at it, and what looks at it. The same record holds truth and belief."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class DualPsd:
    """The fixture with two sensors and the places where it stands; the laser at the flange."""

    laser_origin_m: Floats  # (3,) in the flange frame
    laser_direction: Floats  # (3,) unit
    half_size_m: float
    psd2_in_psd1: Floats  # (4, 4)
    places: Floats  # (place, 4, 4) PSD 1 in the base; place k has id k + 1


@dataclass(frozen=True, eq=False)
class Device:
    """A tracker or a wire drum."""

    pose: Floats  # (4, 4) in the base


@dataclass(frozen=True, eq=False)
class Artefacts:
    """Cones, and bars with a seat at each end. Each time a bar is held somewhere, its ends are two more seats."""

    seat_m: Floats  # (seat, 3) in the base; seat k has id k + 1; first the cones
    cones: int  # how many of the seats are cones; then follow ends a and b of each holding of a bar
    bar_m: Floats  # (bar,) lengths
    held: Whole  # (holding,) which bar, from 0

    def ends_m(self) -> Floats:
        """Distance between the two ends of each holding, (holding,)."""
        ends = self.seat_m[self.cones :].reshape(-1, 2, 3)
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


@dataclass(frozen=True, eq=False)
class TrueRig:
    """Everything. `instrument` decides which readings the rig gives."""

    arm: Arm
    tool_point_m: Floats  # (3,) target or probe in the flange frame
    instrument: DualPsd | Device | Artefacts
