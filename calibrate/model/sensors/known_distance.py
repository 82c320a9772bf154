"""Known distances between two points that a session shares: PSD 1 centres of placements, or seats. The source of scale.

They speak of the parameters of these points only; no arm pose is involved. Their stated sigma is their weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class KnownDistances:
    """Block (calibrate/fit/joint_problem.py) over points in the base.

    `parameters`: as many a point, point by point in the order of `start_m`; the first three shift it along its axes.
    """

    kind: str  # "placement", "seat"
    parameters: tuple[Parameter, ...]
    start_m: Mapping[int, Floats]  # point -> (3,) in the base
    axes: Mapping[int, Floats]  # point -> (3, 3) the axes as columns, in the base
    between: NDArray[np.int64]  # (row, 2) points
    stated: Floats  # (row,) m
    sigma: Floats  # (row,) m

    def __post_init__(self) -> None:
        unknown = set(self.between.ravel().tolist()) - set(self.start_m)
        if unknown:
            raise DataError(f"known distance: {self.kind} {min(unknown)} is not in the rig; add a [[{self.kind}]]")

    @property
    def rows(self) -> int:
        return len(self.stated)

    @property
    def levers_m(self) -> Floats:
        """(row,) over which a misfit of the readings shows in what is stated: none for a distance."""
        return np.ones(self.rows)

    @property
    def log_det_noise(self) -> float:
        """Logarithm of the determinant of the covariance of all lengths."""
        return 2.0 * float(np.sum(np.log(self.sigma)))

    def residual(self, theta: Floats) -> Floats:
        return (self.spans(theta) - self.stated) / self.sigma

    def spans(self, theta: Floats) -> Floats:
        """(row,) distances for values (param,)."""
        return np.linalg.norm(self._span(theta), axis=1)

    def jacobian(self, theta: Floats) -> Floats:
        span = self._span(theta)
        along = span / np.linalg.norm(span, axis=1, keepdims=True)
        points = list(self.start_m)
        out = np.zeros((self.rows, len(points), len(self.parameters) // len(points)))
        for sign, ends in zip((-1.0, 1.0), self.between.T, strict=True):
            for row, point in enumerate(ends.tolist()):
                out[row, points.index(point), :3] += sign * along[row] @ self.axes[point]
        return out.reshape(self.rows, len(self.parameters)) / self.sigma[:, None]

    def select(self, rows: NDArray[np.intp]) -> "KnownDistances":
        return replace(self, between=self.between[rows], stated=self.stated[rows], sigma=self.sigma[rows])

    def _span(self, theta: Floats) -> Floats:
        """(row, 3) from one point to the other, in the base."""
        shifts = dict(zip(self.start_m, theta.reshape(len(self.start_m), -1)[:, :3], strict=True))
        at = {k: start + self.axes[k] @ shifts[k] for k, start in self.start_m.items()}
        return np.array([at[b] - at[a] for a, b in self.between.tolist()]).reshape(-1, 3)


def distances_between(
    kind: str,
    rig: Rig,
    used: set[int],
    parameters: tuple[Parameter, ...],
    start_m: Mapping[int, Floats],
    axes: Mapping[int, Floats],
) -> tuple[KnownDistances, ...]:
    """One block, or none, of the stated distances of this kind between points that the session has used."""
    listed = [d for d in rig.known_distances if d.of == kind and {d.from_placement, d.to_placement} <= used]
    if not listed:
        return ()
    between = np.array([[d.from_placement, d.to_placement] for d in listed])
    length_m, sigma_m = np.array([d.length_m for d in listed]), np.array([d.sigma_m for d in listed])
    return (KnownDistances(kind, parameters, start_m, axes, between, length_m, sigma_m),)
