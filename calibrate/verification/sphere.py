"""The least-squares sphere of touched points, and the smallest sphere that holds some points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from calibrate.errors import DataError

Floats = NDArray[np.float64]
LEAST = 5  # points: four determine a sphere, and a fifth says something of its error
FLAT = 0.02  # thickness of the points over their width: the radius is then off by some hundred times their errors
INSIDE = 1e-12  # relative: rounding, when a point lies on the sphere


@dataclass(frozen=True, eq=False)
class Sphere:
    """Of points touched."""

    centre_m: Floats  # (3,)
    radius_m: float
    distance_m: Floats  # (point,) of each point from the centre


def fitted_sphere(points_m: Floats) -> Sphere:
    """Least sum of squared radial distances (Gaussian sphere). DataError for fewer than LEAST points, or flat ones.

    Start: the linear form |p|^2 = 2 p . c + (r^2 - |c|^2).
    """
    if len(points_m) < LEAST:
        raise DataError(f"a sphere of {len(points_m)} points: touch it {LEAST} times or more, all round")
    middle = points_m.mean(axis=0)
    p = points_m - middle
    extents_m = np.linalg.svd(p, compute_uv=False)
    if extents_m[-1] <= FLAT * extents_m[0]:
        raise DataError("the touches lie in one plane and show no sphere; touch it all round")
    design = np.column_stack([2.0 * p, np.ones(len(p))])
    found = np.linalg.lstsq(design, np.sum(p**2, axis=1), rcond=None)[0]
    start = np.append(found[:3], np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))

    def beside(x: Floats) -> Floats:
        return np.linalg.norm(p - x[:3], axis=1) - x[3]

    fit = least_squares(beside, start, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    centre = fit.x[:3]
    return Sphere(centre + middle, float(fit.x[3]), np.linalg.norm(p - centre, axis=1))


def enclosing_diameter_m(points_m: Floats) -> float:
    """Diameter of the smallest sphere that holds all points (point, 3).

    Welzl, Smallest enclosing disks (balls and ellipsoids), 1991, without recursion over the points: each that lies
    outside is put on the boundary and the ones before it are gone through again.
    """
    _, radius_m = _smallest(points_m, np.empty((0, 3)))
    return 2.0 * radius_m


def _smallest(points: Floats, boundary: Floats) -> tuple[Floats, float]:
    centre, radius = _through(boundary)
    if len(boundary) == 4:
        return centre, radius
    for i, point in enumerate(points):
        if np.linalg.norm(point - centre) > radius * (1.0 + INSIDE) + INSIDE * 1e-3:
            centre, radius = _smallest(points[:i], np.vstack([boundary, point]))
    return centre, radius


def _through(points: Floats) -> tuple[Floats, float]:
    """Smallest sphere through up to four points; -1 for none, so that every point lies outside."""
    if len(points) == 0:
        return np.zeros(3), -1.0
    spans = points[1:] - points[0]
    if len(spans) == 0:
        return points[0], 0.0
    shares = np.linalg.lstsq(2.0 * spans @ spans.T, np.sum(spans**2, axis=1), rcond=1e-12)[0]
    offset = shares @ spans
    return points[0] + offset, float(np.linalg.norm(offset))
