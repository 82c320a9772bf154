"""How counts of a KPA101 read as volts, and volts as the currents of a face.

Neither the sign of x nor the scale of the sum is certain from documents (clients differ, docs/protocols/kpa101.md):
both are stated in the rig and measured by `selfcheck`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.psd_daq.messages import Flag
from drivers.psd_faces import FaceKind
from drivers.psd_kpa101.messages import FULL_COUNT, FULL_SCALE_V, FULL_SUM_COUNT

Floats = NDArray[np.float64]
HEADS = (FaceKind.PIN_CUSHION, FaceKind.QUADRANT)  # PDP90A; PDQ80A, PDQ30C
DARK_V = 0.02  # 0.2 % of full scale, as for the DAQ box: 66 counts of the differences
SATURATED = (Flag.PSD1_SATURATED, Flag.PSD2_SATURATED)
NO_LIGHT = (Flag.PSD1_NO_LIGHT, Flag.PSD2_NO_LIGHT)


@dataclass(frozen=True)
class Wiring:
    """One unit and its head. ValueError for a sign that is none, or scales not above 0."""

    x_sign: int = -1
    y_sign: int = 1
    sum_full_scale_v: float = 10.0  # at 65535 counts
    transimpedance_v_a: float = 1e5  # of the head; 100 kV/A in a PDP90A; places no spot

    def __post_init__(self) -> None:
        if self.x_sign not in (-1, 1) or self.y_sign not in (-1, 1):
            raise ValueError(f"x_sign {self.x_sign!r}, y_sign {self.y_sign!r}; give 1 or -1")
        if not (self.sum_full_scale_v > 0.0 and self.transimpedance_v_a > 0.0):
            raise ValueError(f"sum_full_scale_v and transimpedance_v_a must be above 0, not {self}")

    def volts(self, counts: NDArray[np.int64]) -> Floats:
        """(sample, 3) counts of x, y, sum to V."""
        per_count = FULL_SCALE_V / FULL_COUNT
        return counts.astype(np.float64) * np.array(
            [self.x_sign * per_count, self.y_sign * per_count, self.sum_full_scale_v / FULL_SUM_COUNT]
        )


def currents(signal_v: Floats, transimpedance_v_a: float) -> Floats:
    """Corner currents (sample, 4) A, in the order of a pin-cushion or quadrant face, with these differences and sum.

    The unit tells three signals of four currents. Whatever the fourth was, the spot is a function of these three, so
    currents with the same signals read as the same spot: nothing is lost, nothing added.
    """
    x, y, total = np.moveaxis(signal_v / transimpedance_v_a, -1, 0)
    return 0.25 * np.stack([total - x + y, total + x + y, total + x - y, total - x - y], axis=-1)


def flags(place: int, counts: NDArray[np.int64], signal_v: Floats) -> NDArray[np.uint16]:
    """Flags (sample,) of unit `place`, 0 or 1: a count at its end, and no light."""
    at_end = (np.abs(counts[:, :2]) >= FULL_COUNT).any(axis=1) | (counts[:, 2] >= FULL_SUM_COUNT)
    dark = signal_v[:, 2] < DARK_V
    return (at_end * int(SATURATED[place]) + dark * int(NO_LIGHT[place])).astype(np.uint16)
