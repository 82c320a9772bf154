"""A circle in space through measured points, with its doubt: least squares of what sticks out of plane and radius.

The joint's readings take no part but for the sense of turning, so gear and encoder errors do not bend the axis.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.fit import Status, solve
from calibrate.identifiability import analyse
from calibrate.parameters import Parameter
from calibrate.rigid import cross

Floats = NDArray[np.float64]

NAMES = ("circle.x", "circle.y", "circle.z", "circle.tilt_u", "circle.tilt_v", "circle.radius")


@dataclass(frozen=True)
class Circle:
    """Axis line (centre, normal) and radius."""

    status: Status
    centre_m: Floats  # (3,)
    normal: Floats  # (3,) unit; the motion is right-handed about it
    radius_m: float
    across: Floats  # (2, 3) unit vectors u, v in the plane; tilts turn the normal towards them
    covariance: Floats  # (6, 6) of centre, tilt u, tilt v, radius; nan where these points do not determine them
    scatter_m: float  # of one coordinate, from the residuals
    dof: int

    @property
    def centre_sigma_m(self) -> Floats:
        """(3,) of the centre."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def normal_sigma_rad(self) -> float:
        """The larger of both tilts."""
        return float(np.sqrt(np.diag(self.covariance)[3:5].max()))

    @property
    def radius_sigma_m(self) -> float:
        return float(np.sqrt(self.covariance[5, 5]))

    def moved(self, change: Floats) -> "Circle":
        """The circle after small changes (6,) of centre, tilts and radius."""
        normal = self.normal + change[3:5] @ self.across
        normal = normal / np.linalg.norm(normal)
        return Circle(
            self.status,
            self.centre_m + change[:3],
            normal,
            self.radius_m + float(change[5]),
            self.across,
            self.covariance,
            self.scatter_m,
            self.dof,
        )


def fit_circle(points_m: Floats, angle_rad: Floats) -> Circle:
    """Circle through points (point, 3) that a joint at readings (point,) swept. DataError for fewer than 5 points.

    Start: plane by the smallest singular vector, centre by Kasa's linear equations |p|^2 = 2 p.c + k (Kasa, IEEE Trans.
    Instrum. Meas. 25(1), 1976); then geometric least squares. Doubt from the residuals' own scatter.
    """
    if len(points_m) < 5:
        raise DataError(f"circle: {len(points_m)} points; at least 5 are needed to fit it and to estimate its noise")
    start = _start(points_m, angle_rad)
    parameters = tuple(
        Parameter(n, "rad" if "tilt" in n else "m", 0.1 if "tilt" in n else max(start.radius_m, 1e-3)) for n in NAMES
    )
    points = _Points(parameters, points_m, start, max(start.radius_m, 1e-3) * 1e-6)
    fit = solve(points, max_steps=200)
    dof = fit.dof
    scale = fit.chi2 / dof  # residuals are whitened by a nominal size only: their scatter is the noise
    seen = analyse(points.jacobian(fit.theta) / np.sqrt(max(scale, 1e-30)), parameters)
    status = Status.RANK_DEFICIENT if fit.status is Status.CONVERGED and seen.combinations else fit.status
    covariance = fit.covariance * scale if status is Status.CONVERGED else np.full((6, 6), np.nan)
    end = start.moved(fit.theta)
    scatter_m = points.size_m * float(np.sqrt(scale))
    return Circle(status, end.centre_m, end.normal, end.radius_m, start.across, covariance, scatter_m, dof)


def _start(points_m: Floats, angle_rad: Floats) -> Circle:
    middle = points_m.mean(axis=0)
    flat = points_m - middle
    u, v, normal = np.linalg.svd(flat, full_matrices=True)[2]
    x, y = flat @ u, flat @ v
    rows = np.stack([2.0 * x, 2.0 * y, np.ones_like(x)], axis=1)
    a, b, k = np.linalg.lstsq(rows, x**2 + y**2, rcond=None)[0].tolist()
    centre = middle + a * u + b * v
    spoke = points_m - centre
    order = np.argsort(angle_rad)
    sense = float(np.sum(cross(spoke[order][:-1], spoke[order][1:]) @ normal))
    if sense < 0.0:
        normal, v = -normal, -v
    radius_m = float(np.sqrt(max(k + a * a + b * b, 0.0)))
    unknown = np.full((6, 6), np.nan)
    return Circle(Status.CONVERGED, centre, normal, radius_m, np.stack([u, v]), unknown, float("nan"), 0)


@dataclass(frozen=True)
class _Points:
    """LeastSquares of points about a circle: out of plane, and off the radius."""

    parameters: tuple[Parameter, ...]
    points_m: Floats
    start: Circle
    size_m: float  # whitens; the real noise is told by the residuals

    def residual(self, theta: Floats) -> Floats:
        circle, spoke, out = self._seen(theta)
        inside = spoke - out[:, None] * circle.normal
        return np.stack([out, np.linalg.norm(inside, axis=1) - circle.radius_m], axis=1).ravel() / self.size_m

    def jacobian(self, theta: Floats) -> Floats:
        circle, spoke, out = self._seen(theta)
        inside = spoke - out[:, None] * circle.normal
        length = np.linalg.norm(inside, axis=1)
        J = np.zeros((len(spoke), 2, 6))
        J[:, 0, :3], J[:, 1, :3] = -circle.normal, -inside / length[:, None]
        J[:, 0, 3:5] = spoke @ self._normal_by_tilt(theta)
        J[:, 1, 3:5] = -(out / length)[:, None] * J[:, 0, 3:5]
        J[:, 1, 5] = -1.0
        return J.reshape(-1, 6) / self.size_m

    def _seen(self, theta: Floats) -> tuple[Circle, Floats, Floats]:
        circle = self.start.moved(theta)
        spoke = self.points_m - circle.centre_m
        return circle, spoke, spoke @ circle.normal

    def _normal_by_tilt(self, theta: Floats) -> Floats:
        """(3, 2) derivative of the unit normal, which `moved` brings back to length 1."""
        raw = self._raw_normal + theta[3:5] @ self.start.across
        length = np.linalg.norm(raw)
        unit = raw / length
        return ((np.eye(3) - np.outer(unit, unit)) @ self.start.across.T) / length

    @cached_property
    def _raw_normal(self) -> Floats:
        return self.start.normal
