"""Known distances and angles of touched planes, such as the faces of a cube. They speak of the planes alone.

A stated distance is that of two parallel planes. It is asked for at three points of the second plane: the middle of its
touches, and along both of its axes as far away as the touches are (rms). So it also states how parallel the planes are:
to `sigma_m` over the part that was touched.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.parameters import Parameter
from calibrate.model.problem import Block

Floats = NDArray[np.float64]
STEP = 1e-6  # of a central difference: of smooth functions of order 1, good to 1e-10


@dataclass(frozen=True)
class KnownPlanes:
    """Block (calibrate/fit/joint_problem.py). Parameters: roll, pitch, z of each plane, in the order of `start_m`."""

    parameters: tuple[Parameter, ...]
    start_m: Mapping[int, Floats]  # plane -> (3,) in the base
    axes: Mapping[int, Floats]  # plane -> (3, 3) its axes as columns, in the base
    extent_m: Mapping[int, float]  # plane -> rms distance of its touches from their middle
    between: NDArray[np.int64]  # (row, 2) planes
    stated: Floats  # (row,) m, or rad of angles
    sigma: Floats  # (row,) in the same unit
    angles: bool = False

    @property
    def width(self) -> int:
        """Residuals of a row."""
        return 1 if self.angles else 3

    @property
    def rows(self) -> int:
        return len(self.stated)

    @property
    def row_widths(self) -> NDArray[np.intp]:
        """(row,) residual values of each."""
        return np.full(self.rows, self.width, dtype=np.intp)

    @property
    def levers_m(self) -> Floats:
        """(row,) over which a misfit of the readings shows in what is stated: of an angle, the touched part."""
        if not self.angles:
            return np.ones(self.rows)
        return np.array([min(self.extent_m[a], self.extent_m[b]) for a, b in self.between.tolist()])

    @property
    def log_det_noise(self) -> float:
        return 2.0 * self.width * float(np.sum(np.log(self.sigma)))

    def residual(self, theta: Floats) -> Floats:
        return (self._misfit(theta) / self.sigma[:, None]).ravel()

    def spans(self, theta: Floats) -> Floats:
        """(row,) distances, m, from the middle of the second plane, or angles, rad, for values (param,)."""
        return self._misfit(theta)[:, 0] + self.stated

    def jacobian(self, theta: Floats) -> Floats:
        steps = STEP * np.eye(len(theta))
        return np.stack([(self.residual(theta + s) - self.residual(theta - s)) / (2.0 * STEP) for s in steps], axis=1)

    def select(self, rows: NDArray[np.intp]) -> "KnownPlanes":
        return replace(self, between=self.between[rows], stated=self.stated[rows], sigma=self.sigma[rows])

    def _misfit(self, theta: Floats) -> Floats:
        """(row, width) distances at the three points, or the angle, less what is stated."""
        found = dict(zip(self.start_m, theta.reshape(-1, 3), strict=True))
        each = self._angle if self.angles else self._distances_m
        out = [each(found, a, b) - stated for (a, b), stated in zip(self.between.tolist(), self.stated, strict=True)]
        return np.array(out).reshape(-1, self.width)

    def _distances_m(self, found: Mapping[int, Floats], a: int, b: int) -> Floats:
        """(3,) of the points of plane b from plane a, positive on the side where they are nominally."""
        roll, pitch, z = found[b]
        normal, reach_m = self._normal(found, b), self.extent_m[b]
        x, y, _ = (self.axes[b] + np.outer(self.axes[b][:, 2], (-pitch, roll, 0.0))).T
        middle = self.start_m[b] + z * normal
        points = np.stack([middle, middle + reach_m * x, middle + reach_m * y])
        side = np.sign((self.start_m[b] - self.start_m[a]) @ self.axes[a][:, 2])
        return side * ((points - self.start_m[a]) @ self._normal(found, a) - found[a][2])

    def _angle(self, found: Mapping[int, Floats], a: int, b: int) -> Floats:
        """Up to a right angle by the nominal planes: a plane has no sides."""
        side = 1.0 if self.axes[a][:, 2] @ self.axes[b][:, 2] >= 0.0 else -1.0
        return np.arccos(np.clip(side * self._normal(found, a) @ self._normal(found, b), -1.0, 1.0))

    def _normal(self, found: Mapping[int, Floats], k: int) -> Floats:
        """(3,) unit, as in plane.py: of z + pitch x - roll y."""
        roll, pitch, _ = found[k]
        raw = self.axes[k] @ np.array([pitch, -roll, 1.0])
        return raw / np.linalg.norm(raw)


def known_planes(
    rig: Rig,
    parameters: tuple[Parameter, ...],
    start_m: Mapping[int, Floats],
    axes: Mapping[int, Floats],
    extent_m: Mapping[int, float],
) -> tuple[Block, ...]:
    """Of what the rig states of planes that were touched: the distances, and the angles."""
    distances = [
        ((d.from_placement, d.to_placement), d.length_m, d.sigma_m) for d in rig.known_distances if d.of == "plane"
    ]
    angles = [((a.from_plane, a.to_plane), a.angle_rad, a.sigma_rad) for a in rig.known_angles]
    out: list[Block] = []
    for stated, are_angles in ((distances, False), (angles, True)):
        used = [one for one in stated if set(one[0]) <= set(start_m)]
        if used:
            between, value, sigma = (np.array(part) for part in zip(*used, strict=True))
            out.append(KnownPlanes(parameters, start_m, axes, extent_m, between, value, sigma, are_angles))
    return tuple(out)
