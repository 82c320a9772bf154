"""How well a set of poses shows the parameters: observability indices, condition and predicted sigma.

Of the singular values s_1 >= ... >= s_m of the whitened data Jacobian in columns of plausible size, without priors, at
n poses:  O1 = (s_1 ... s_m)^(1/m) / sqrt(n);  O2 = s_m / s_1;  O3 = s_m;  O4 = s_m^2 / s_1;  O5 = 1 / sum(1 / s).
Sources: Borm, Menq, Int. J. Robotics Research 10(5), 1991 (O1); Driels, Pathre, J. Robotic Systems 7(1), 1990 (O2);
Nahvi, Hollerbach, Hayward, ICRA 1994 (O3) and Nahvi, Hollerbach, ICRA 1996 (O4); Sun, Hollerbach, ICRA 2008 (O5).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.rank.identifiability import STRUCTURAL
from calibrate.model.parameters import Parameter, plausible_sizes

Floats = NDArray[np.float64]

WELL_CONDITIONED = 100.0  # of the scaled Jacobian: Schroer's rule, quoted by Nahvi and Hollerbach, ICRA 1996


@dataclass(frozen=True)
class Observability:
    """Indices of the free parameters; all zero (condition infinite) where the data leave a combination unseen."""

    o1: float
    o2: float
    o3: float
    o4: float
    o5: float
    condition: float  # largest over smallest singular value
    rank: int
    n_free: int
    sigma: Floats  # (free,) predicted of each free parameter by these data alone; inf for all where rank is short

    @property
    def well_conditioned(self) -> bool:
        """Below the usual limit of 100."""
        return self.condition < WELL_CONDITIONED


def observability(jacobian: Floats, parameters: tuple[Parameter, ...], poses: int) -> Observability:
    """Indices from the whitened Jacobian (row, param) of `poses` poses. Hold redundant parameters first."""
    free = np.flatnonzero([p.free for p in parameters])
    scale = plausible_sizes(parameters)[free]
    n = len(free)
    padded = np.concatenate([jacobian[:, free] * scale, np.zeros((n, n))])  # fewer rows than columns: zeros at the end
    _, s, Vt = np.linalg.svd(np.linalg.qr(padded, mode="r"))
    rank = int(np.sum(s > STRUCTURAL * s.max(initial=0.0)))
    if rank < n or n == 0:
        return Observability(0.0, 0.0, 0.0, 0.0, 0.0, float("inf"), rank, n, np.full(n, np.inf))
    return Observability(
        float(np.exp(np.mean(np.log(s))) / np.sqrt(poses)),
        float(s[-1] / s[0]),
        float(s[-1]),
        float(s[-1] ** 2 / s[0]),
        float(1.0 / np.sum(1.0 / s)),
        float(s[0] / s[-1]),
        rank,
        n,
        scale * np.linalg.norm(Vt.T / s, axis=1),
    )
