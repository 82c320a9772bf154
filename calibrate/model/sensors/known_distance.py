"""Known distances between the PSD 1 centres of two placements: a ruler laid beside the session, the source of scale.

They speak of placement parameters only; no arm pose is involved. Their stated sigma is their weight.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.optics.dual_psd import DualPsd
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class KnownDistances:
    """Block (calibrate/fit/joint_problem.py) over the placements of a dual PSD."""

    sensor: DualPsd
    between: NDArray[np.int64]  # (row, 2) placement ids
    length_m: Floats  # (row,)
    sigma_m: Floats  # (row,)

    def __post_init__(self) -> None:
        unknown = set(self.between.ravel().tolist()) - set(self.sensor.places)
        if unknown:
            raise DataError(f"known distance: placement {min(unknown)} is not in the rig; add a [[placement]]")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(p for p in self.sensor.parameters if p.name.startswith("placement"))

    @property
    def rows(self) -> int:
        return len(self.length_m)

    @property
    def log_det_noise(self) -> float:
        """Logarithm of the determinant of the covariance of all lengths."""
        return 2.0 * float(np.sum(np.log(self.sigma_m)))

    def residual(self, theta: Floats) -> Floats:
        return (np.linalg.norm(self._span(theta), axis=1) - self.length_m) / self.sigma_m

    def jacobian(self, theta: Floats) -> Floats:
        span = self._span(theta)
        along = span / np.linalg.norm(span, axis=1, keepdims=True)
        out = np.zeros((self.rows, len(self.sensor.places), 6))
        for sign, places in zip((-1.0, 1.0), self.between.T, strict=True):
            for row, place in enumerate(places.tolist()):
                k = self.sensor.places.index(place)
                out[row, k, :3] += sign * along[row] @ self.sensor.fixture.T_base_psd1[place][:3, :3]
        return out.reshape(self.rows, 6 * len(self.sensor.places)) / self.sigma_m[:, None]

    def select(self, rows: NDArray[np.intp]) -> "KnownDistances":
        return replace(self, between=self.between[rows], length_m=self.length_m[rows], sigma_m=self.sigma_m[rows])

    def _span(self, theta: Floats) -> Floats:
        """(row, 3) from one PSD 1 centre to the other, in the base."""
        shift = theta.reshape(-1, 6)[:, :3]
        centre = {
            k: T[:3, 3] + T[:3, :3] @ shift[self.sensor.places.index(k)]
            for k, T in self.sensor.fixture.T_base_psd1.items()
        }
        return np.array([centre[b] - centre[a] for a, b in self.between.tolist()]).reshape(-1, 3)
