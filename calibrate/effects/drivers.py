"""Drivers: what a defect may depend on, one value a pose. From the record or from the model, never from what was
measured: a measured spot as driver leaks the answer (a gain would explain any noise).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig_schema import Rig
from calibrate.effects.conditions import Conditions
from calibrate.sensors.catalogue import names_with
from calibrate.sensors.kind import Trait

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Readout:
    """One instrument as the model predicts it; rows (pose,) that it does not see are NaN."""

    name: str  # of a sensor, as in calibrate/sensors/catalogue.py
    predicted: Floats  # (pose, k)
    seen: NDArray[np.bool_]  # (pose,)
    incidence_rad: Floats | None = None  # (pose, 2) of the beam on PSD 1, 2
    lean: Floats | None = None  # (pose, 2, 2) x, y that the arriving beam travels along face 1, 2 per depth
    first_psd: Ints | None = None  # (pose,)
    place: Ints | None = None  # (pose,) placement or seat
    joints: tuple[int, ...] = ()  # (k,) of second encoders, from 1


@dataclass(frozen=True, eq=False, kw_only=True)
class Drivers(Conditions):
    """Of the whole session, in the order of its samples."""

    rig: Rig
    frames: Floats  # (pose, joint + 1, 4, 4) B_0 ... B_n of the model with its terms
    readouts: Mapping[str, Readout]

    def having(self, trait: Trait) -> tuple[str, ...]:
        """Names of the instruments of the session that have it, in the order of the catalogue."""
        return tuple(name for name in names_with(trait) if name in self.readouts)

    @property
    def light(self) -> Readout | None:
        """Of the spots on a dual PSD."""
        names = self.having(Trait.LIGHT)
        return self.readouts[names[0]] if names else None

    @property
    def gravity_m_s2(self) -> Floats:
        return np.array(self.rig.arm.gravity_m_s2)
