"""A whole rig in numbers: the arm, what hangs at it, and what observes it. The same record holds truth and assumption.

How far the true rig lies from its drawing: six small motions at every link, zeros, tool, laser, places, device.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, moved

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
ENCODER_RAD = 4e-6  # one sigma of a measuring arm's encoders


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
    tool_point_m: Floats  # (3,) target or probe in the flange frame; (row, 3) where several are read in turn
    instrument: DualPsd | Device | Artefacts


@dataclass(frozen=True)
class Spread:
    """One sigma of each deviation."""

    length_m: float
    angle_rad: float
    zero_rad: float
    tool_m: float
    laser_rad: float
    place_m: float
    place_rad: float
    psd2_m: float
    psd2_rad: float
    device_m: float
    device_rad: float
    mass: float  # share


def perturbed(rig: TrueRig, spread: Spread, rng: np.random.Generator) -> TrueRig:
    """A true rig around an assumed one."""
    tool_point_m = rig.tool_point_m + spread.tool_m * rng.standard_normal(3)
    return TrueRig(_arm(rig.arm, spread, rng), tool_point_m, _instrument(rig.instrument, spread, rng))


def _arm(arm: Arm, spread: Spread, rng: np.random.Generator) -> Arm:
    parts, n = len(arm.fixed), arm.n_joints
    small = moved(spread.length_m * rng.standard_normal((parts, 3)), spread.angle_rad * rng.standard_normal((parts, 3)))
    heavier = 1.0 + spread.mass * rng.uniform(-1.0, 1.0, n)
    return replace(
        arm,
        fixed=arm.fixed @ small,
        zero_rad=arm.zero_rad + spread.zero_rad * rng.standard_normal(n),
        mass_kg=arm.mass_kg * heavier,
        com_m=arm.com_m + 0.03 * spread.mass * rng.standard_normal((n, 3)),
        tool_kg=arm.tool_kg * float(1.0 + spread.mass * rng.uniform(-1.0, 1.0)),
    )


def _instrument(
    instrument: DualPsd | Device | Artefacts, spread: Spread, rng: np.random.Generator
) -> DualPsd | Device | Artefacts:
    if isinstance(instrument, Device):
        off = moved(spread.device_m * rng.standard_normal(3), spread.device_rad * rng.standard_normal(3))
        return Device(instrument.pose @ off)
    if isinstance(instrument, Artefacts):
        return instrument
    places = len(instrument.places)
    tilted = instrument.laser_direction + spread.laser_rad * rng.standard_normal(3)
    return replace(
        instrument,
        laser_origin_m=instrument.laser_origin_m + spread.tool_m * rng.standard_normal(3),
        laser_direction=tilted / np.linalg.norm(tilted),
        psd2_in_psd1=instrument.psd2_in_psd1
        @ moved(spread.psd2_m * rng.standard_normal(3), spread.psd2_rad * rng.standard_normal(3)),
        places=instrument.places
        @ moved(spread.place_m * rng.standard_normal((places, 3)), spread.place_rad * rng.standard_normal((places, 3))),
    )
