"""From the rig file to the dual-PSD chain that is fitted, and to the noise that is believed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig_schema import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.chain import Chain
from calibrate.default_belief import links_of, pair_of
from calibrate.errors import DataError
from calibrate.rigid import transform
from calibrate.sensors.dual_psd import DualPsd, Fixture
from calibrate.sensors.laser import LaserMount

PSD_BELIEVED_M = 2e-6  # a PSD in shop conditions (Deng, Ding, Zhang, Food & Machinery 2019(3))
JOINT_BELIEVED_RAD = (
    1e-5  # 10 um at 1 m reach: repeatability class of small arms (calibration data sheets: 0.01-0.03 mm)
)


@dataclass(frozen=True)
class BelievedNoise:
    """One sigma as the rig file states it; a start value only."""

    joint_rad: float
    psd_m: float  # of a spot, where the samples state none


def fixture_of(rig: Rig) -> Fixture:
    """Both faces and where they are believed to have stood. DataError where the rig has no fixture."""
    if rig.fixture is None or not rig.placements:
        raise DataError(f"rig {rig.name}: no [fixture] with a [[placement]]; dual-PSD data need both")
    pair = rig.fixture.psd2_in_psd1
    places = {k: transform(p.psd1_in_base.origin_m, p.psd1_in_base.rotation_rad) for k, p in rig.placements.items()}
    return Fixture(rig.fixture.half_size_m, transform(pair.origin_m, pair.rotation_rad), places)


def laser_of(rig: Rig) -> LaserMount:
    """The laser as drawn. DataError where the rig has none."""
    if rig.tool.laser_origin_m is None or rig.tool.laser_direction is None:
        raise DataError(f"rig {rig.name}: tool.laser_origin_m and tool.laser_direction are needed for dual-PSD data")
    return LaserMount.from_drawing(np.array(rig.tool.laser_origin_m), np.array(rig.tool.laser_direction))


def dual_psd_chain(rig: Rig, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> Chain:
    """The rig's arm with its dual PSD, for poses with these placements and orders (pose,), (pose,).

    Links and detectors as [tolerance] believes them, without one as default_belief.py.
    """
    return Chain(arm_of(rig, links_of(rig)), dual_psd_of(rig, placement, first_psd))


def dual_psd_of(rig: Rig, placement: NDArray[np.int64], first_psd: NDArray[np.int64]) -> DualPsd:
    """The instrument alone; gains and PSD 2 in PSD 1 free under the [tolerance] that doubts them."""
    gain = None if rig.tolerance is None else rig.tolerance.gain
    return DualPsd(laser_of(rig), fixture_of(rig), placement, first_psd, gain, pair_of(rig))


def believed_noise(rig: Rig) -> BelievedNoise:
    """The rig's [noise]; what is missing there is a usual value, since the data decide anyway."""
    return BelievedNoise(rig.noise.joint_rad or JOINT_BELIEVED_RAD, rig.noise.psd_m or PSD_BELIEVED_M)
