"""Does anything repeat that the model does not know: misfit of repeated poses against the scatter within them.

Repeats are no pure noise (time, approach, payload differ), so both are taken after the model. Source: Draper, Smith,
Applied Regression Analysis, 3rd ed. 1998, ch. 2.1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from calibrate.diagnose.assess import limits
from calibrate.diagnose.search.bench import Bench

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class LackOfFit:
    """Misfit that repeats over scatter within repeats, both per degree of freedom."""

    groups: int
    ratio: float
    p: float

    @property
    def significant(self) -> bool:
        return self.p < limits.REPEATS_ALPHA


def lack_of_fit(bench: Bench) -> LackOfFit | None:
    """None where too few poses repeat."""
    rows, repeat = bench.state.rows, bench.state.drivers.repeat
    if repeat is None:
        return None
    group = np.where(rows.data, repeat[np.maximum(rows.sample, 0)], -1)
    within, between, dof_within, dof_between, groups = 0.0, 0.0, 0, 0, 0
    for label in np.unique(group[group >= 0]):
        for mine in _channels(rows.group, np.flatnonzero(group == label)):
            if len(mine) < 2:
                continue
            z = bench.state.rows.residual[mine]
            within += float(np.sum((z - z.mean()) ** 2))
            between += float(len(z) * z.mean() ** 2)
            dof_within, dof_between = dof_within + len(z) - 1, dof_between + 1
        groups += 1
    if groups < limits.FEWEST_GROUPS or dof_within == 0 or within <= 0.0:
        return None
    # Geometry follows the means a little: as much as its share of all data.
    free = dof_between * (1.0 - bench.sight.basis.shape[1] / bench.sight.data)
    ratio = (between / max(free, 1.0)) / (within / dof_within)
    return LackOfFit(groups, ratio, float(fdtrc(free, dof_within, ratio)))


def _channels(group: Ints, mine: Ints) -> list[Ints]:
    """Rows of one repeat group, one array for each channel of the reading."""
    observations = [mine[group[mine] == g] for g in np.unique(group[mine])]
    k = min(len(o) for o in observations)
    return [np.array([o[c] for o in observations]) for c in range(k)]
