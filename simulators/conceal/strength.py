"""Effect over noise: how much of a defect is left, in one sigmas per reading, when geometry has taken what it can."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.geometry import Absorber
from simulators.conceal.observe import Observed
from simulators.defects.defect import AnyDefect, Defect, size_of, with_size

Floats = NDArray[np.float64]
Watch = Callable[[Sequence[Defect]], Observed]  # the session with these defects, noise-free
Whiten = Callable[[Floats], Floats]  # change of the readings (row, channel) in sigmas, flat
# Times the typical size: beyond, a mechanism would be found with the naked eye. Where a material sets a bound, the
# mechanism states its own LARGEST.
FARTHEST = 12.0
INVISIBLE = 0.05  # effect over noise of the largest plausible size: geometry takes it all, and size does not matter
STEPS = 3  # most effects are in proportion to their size; the rest need another try or two


@dataclass(frozen=True, eq=False)
class Scale:
    """One session's measure of how strong a defect is."""

    watch: Watch
    whiten: Whiten
    absorber: Absorber
    perfect: Observed

    def enr(self, defects: Sequence[Defect]) -> float:
        """Rms of what geometry leaves of these defects, over the noise."""
        change = self.whiten(self.watch(defects).values_m - self.perfect.values_m)
        return float(np.sqrt(np.mean(self.absorber.left_over(change) ** 2)))

    def raw(self, defects: Sequence[Defect]) -> float:
        """The same before geometry takes its share."""
        change = self.whiten(self.watch(defects).values_m - self.perfect.values_m)
        return float(np.sqrt(np.mean(change**2)))

    def brought_to(self, defect: AnyDefect, enr: float) -> tuple[AnyDefect, float]:
        """The defect with about this effect over noise, and what it truly has; no more than plausible.

        One that no plausible size would show keeps the size that it was drawn with.
        """
        drawn, most = defect, float(getattr(defect, "LARGEST", FARTHEST * defect.TYPICAL))
        for _ in range(STEPS):
            found = self.enr([defect])
            if found <= 0.0 or not np.isfinite(found):
                return drawn, 0.0
            size = float(np.clip(size_of(defect) * enr / found, -most, most))
            defect = with_size(defect, size)
        reached = self.enr([defect])
        return (defect, reached) if reached > INVISIBLE else (drawn, self.enr([drawn]))
