"""Steps of a length in colours that darken evenly, so that they also read in grey and to colour-blind eyes.

The colours are cividis: Nunez, Anderton, Renslow, PLOS ONE 13(7), 2018, made for readers with and without a deficiency
in colour vision.
"""

from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

Floats = NDArray[np.float64]

COARSE = (1.0, 2.0, 5.0)  # of a decade
FINE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
AT_MOST = 12  # steps: with more of the fine ones the coarse ones are taken
LEAST = 0.05  # quantile of the values below which steps would only serve single points


@dataclass(frozen=True)
class Steps:
    """Bounds (step + 1,) in m and a colour for each step between two of them."""

    bounds_m: tuple[float, ...]
    colours: tuple[str, ...]
    open_below: bool = False  # whether smaller values count to the first step

    def of(self, values_m: Floats) -> NDArray[np.intp]:
        """Number of the step of each value; what is outside counts to the first or last. -1 where not finite."""
        step = np.clip(np.searchsorted(self.bounds_m, values_m, side="right") - 1, 0, len(self.colours) - 1)
        return np.where(np.isfinite(values_m), step, -1)


def steps_for(values_m: Floats) -> Steps:
    """Round steps over all finite values but the very smallest; those that a page can show: the largest."""
    finite = values_m[np.isfinite(values_m) & (values_m > 0.0)]
    low, high = (float(np.quantile(finite, LEAST)), float(np.max(finite))) if len(finite) else (1e-6, 1e-5)
    bounds = _between(low, high, FINE)
    if len(bounds) > AT_MOST + 1:
        bounds = _between(low, high, COARSE)[-AT_MOST - 1 :]
    ramp = mpl.colormaps["cividis"](np.linspace(1.0, 0.0, len(bounds) - 1))
    below = bool(np.any(finite < bounds[0]))
    return Steps(tuple(bounds), tuple(to_hex(colour) for colour in ramp), below)


def _between(low: float, high: float, marks: tuple[float, ...]) -> list[float]:
    """Round numbers, the first at most `low`, the last at least `high`, two at least."""
    first, last = int(np.floor(np.log10(low))), int(np.floor(np.log10(high))) + 1
    listed = [float(f"{m:g}e{d}") for d in range(first, last + 1) for m in marks]
    begin = max(i for i, mark in enumerate(listed) if mark <= low * (1.0 + 1e-12))
    end = min(i for i, mark in enumerate(listed) if mark >= high and i > begin)
    return listed[begin : end + 1]
