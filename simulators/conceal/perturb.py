"""How far the true rig lies from its drawing: six small motions at every link, zeros, tool, laser, places, device."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm
from simulators.arm.rigid import moved
from simulators.conceal.rig import Artefacts, Device, DualPsd, TrueRig

Floats = NDArray[np.float64]


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
    """A true rig around a believed one."""
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
