"""A session as it would be recorded without noise: joint readings and what the instrument says."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.chain import stand
from simulators.conceal.readings import length_m, position_m, spots
from simulators.conceal.rig import Device, DualPsd, TrueRig
from simulators.conceal.seated import seated_readings, seated_tip_m
from simulators.defects import Defect, Scene

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Observed:
    """Noise-free."""

    reading_rad: Floats  # (row, n) what the encoders say
    values_m: Floats  # (row, channel); for a seated probe: where a perfect arm with these readings would have its probe
    sum_v: Floats | None  # (row, 2) of a dual PSD


def observe(
    rig: TrueRig, scene: Scene, defects: Sequence[Defect], reading_rad: Floats, *, wire: bool = False
) -> Observed:
    """`reading_rad` (row, n): where a robot is sent; for a seated probe, the posture the operator holds it in."""
    instrument = rig.instrument
    if not isinstance(instrument, (DualPsd, Device)):
        said_rad = seated_readings(rig, instrument, scene, defects, reading_rad)
        return Observed(said_rad, seated_tip_m(rig, said_rad), None)
    stance = stand(rig, scene, defects, reading_rad)
    if isinstance(instrument, DualPsd):
        seen = spots(rig, instrument, scene, defects, stance)
        return Observed(reading_rad, seen.seen_m, seen.sum_v)
    measure = length_m if wire else position_m
    return Observed(reading_rad, measure(rig, instrument, scene, defects, stance), None)
