"""From the rig file to the dual-PSD chain that is fitted, and to the noise that is assumed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.chain import SensorChain
from calibrate.model.default_tolerance import links_of
from calibrate.model.sensors.spots import dual_psd_of as dual_psd_of
from calibrate.model.sensors.spots import fixture_of as fixture_of
from calibrate.model.sensors.spots import laser_of as laser_of
from calibrate.model.sensors.spots import psd_sigma_m

JOINT_ASSUMED_RAD = (
    1e-5  # 10 µm at 1 m reach: repeatability class of small arms (calibration data sheets: 0.01-0.03 mm)
)


@dataclass(frozen=True)
class AssumedNoise:
    """One sigma as the rig file states it; a start value only."""

    joint_rad: float
    psd_m: float  # of a spot, where the samples state none


def dual_psd_chain(rig: Rig, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> SensorChain:
    """The rig's arm with its dual PSD, for poses with these placements and orders (pose,), (pose,).

    Links and detectors as [tolerance] states them, without one as default_tolerance.py.
    """
    return SensorChain(arm_of(rig, links_of(rig)), dual_psd_of(rig, placement, first_psd))


def assumed_noise(rig: Rig) -> AssumedNoise:
    """The rig's [noise]; what is missing there is a usual value, since the data decide anyway."""
    return AssumedNoise(rig.noise.joint_rad or JOINT_ASSUMED_RAD, psd_sigma_m(rig))
