"""What a recording holds to verify an arm by (positions of the probe by cone, sphere and bar), and figures made of it.

A figure of a standard is what was measured beside what is permitted. Spheres: the least-squares sphere of touched
points, and the smallest sphere that holds some points.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import BAR, SEAT
from calibrate.errors import DataError
from calibrate.model.predict import Predictor
from calibrate.model.sensors.bar import bar_pairs


class Judgement(Enum):
    """How a figure stands."""

    CONFORMS = "within the permissible error"
    FAILS = "beyond the permissible error"
    NOT_STATED = "no permissible error is stated"
    NOT_MEASURED = "the recording holds nothing of it"


@dataclass(frozen=True)
class Source:
    """Where a formula stands. Sections by their titles: clause numbers are named only where they were read."""

    standard: str
    section: str
    formula: str


@dataclass(frozen=True)
class Figure:
    """A value for the worst of what was measured, and the values it is the worst of."""

    symbol: str
    says: str
    source: Source
    unit: str
    value: float | None
    permitted: float | None
    judgement: Judgement
    taken: int  # measurements behind it: spheres, series, lengths
    asked: int  # by the standard; with fewer it is part of the test only
    each: tuple[tuple[str, float, float | None], ...] = ()  # what, value, permitted there
    also: tuple[tuple[str, float], ...] = ()  # further numbers that the standard reports beside it

    @property
    def complete(self) -> bool:
        """Whether the standard's own number of measurements was taken."""
        return self.taken >= self.asked


def judged(value: float | None, permitted: float | None) -> Judgement:
    """Of one value against its limit, both as magnitudes."""
    if value is None:
        return Judgement.NOT_MEASURED
    if permitted is None:
        return Judgement.NOT_STATED
    return Judgement.CONFORMS if abs(value) <= permitted else Judgement.FAILS


Floats = NDArray[np.float64]
LEAST = 5  # points: four determine a sphere, and a fifth shows something of its error
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

    def residual_of(x: Floats) -> Floats:
        return np.linalg.norm(p - x[:3], axis=1) - x[3]

    fit = least_squares(residual_of, start, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
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


SAME_PLACE_M = 0.05  # of both ends: a bar set up again by hand is nearer to where it was than two positions are apart


@dataclass(frozen=True, eq=False)
class Length:
    """One bar measured once."""

    bar: int
    position: int  # from 1, in order of first use
    calibrated_m: float
    measured_m: float

    @property
    def error_m(self) -> float:
        """Measured less calibrated."""
        return self.measured_m - self.calibrated_m

    @property
    def says(self) -> str:
        return f"bar {self.bar}, position {self.position}"


@dataclass(frozen=True, eq=False)
class BallPlaces:
    """Places of the probe's ball (row, 3) m in the base, by the identified arm."""

    rig: Rig
    seats: Mapping[int, Floats]
    touches: Mapping[tuple[int, int], Floats]  # sphere, series
    lengths: tuple[Length, ...]
    left_out: tuple[str, ...] = ()  # series of touches that show no sphere, and why


def measured(samples: Samples, rig: Rig, predictor: Predictor) -> BallPlaces:
    """Sorted by artefact. DataError where there is none, or one that the rig does not know."""
    tips_m = predictor.tip_m(samples.joints())
    touches, left_out = _round(_touches(samples, rig, tips_m))
    found = BallPlaces(rig, _seats(samples, tips_m), touches, _lengths(samples, rig, tips_m), left_out)
    if not (found.seats or found.touches or found.lengths):
        raise DataError(
            "samples: nothing to verify by; columns of it are seat, bar with bar_end, and sphere with series: "
            "`calibeam session RIG --verify` takes them" + "".join(f"; {why}" for why in left_out)
        )
    return found


def _seats(samples: Samples, tips_m: Floats) -> dict[int, Floats]:
    seat = samples.integers(SEAT, 0)
    return {k: tips_m[seat == k] for k in sorted(set(seat.tolist()) - {0})}


def _touches(samples: Samples, rig: Rig, tips_m: Floats) -> dict[tuple[int, int], Floats]:
    if "sphere" not in samples:
        return {}
    sphere = np.nan_to_num(samples.column("sphere")).astype(np.int64)
    series = np.nan_to_num(samples.column("series")).astype(np.int64) if "series" in samples else np.zeros_like(sphere)
    unknown = set(sphere.tolist()) - {0} - set(rig.spheres)
    if unknown:
        raise DataError(f"samples: sphere {min(unknown)} is not in the rig; add a [[sphere]] with its diameter")
    pairs = sorted({(s, k) for s, k in zip(sphere.tolist(), series.tolist(), strict=True) if s})
    return {(s, k): tips_m[(sphere == s) & (series == k)] for s, k in pairs}


def _round(
    touches: Mapping[tuple[int, int], Floats],
) -> tuple[dict[tuple[int, int], Floats], tuple[str, ...]]:
    """Series without those that are touches enough and yet show no sphere, and sentences of these."""
    good, bad = dict(touches), list[str]()
    for (sphere, series), touches_m in touches.items():
        try:
            if len(touches_m) >= LEAST:
                fitted_sphere(touches_m)
        except DataError as error:
            del good[sphere, series]
            bad.append(f"sphere {sphere}, series {series} left out: {error}")
    return good, tuple(bad)


def _lengths(samples: Samples, rig: Rig, tips_m: Floats) -> tuple[Length, ...]:
    bar = samples.integers(BAR, 0)
    rows = np.flatnonzero(bar)
    if len(rows) == 0:
        return ()
    if "bar_end" not in samples:
        raise DataError("samples: bars without bar_end; add the end (a or b) of each reading")
    unknown = set(bar[rows].tolist()) - set(rig.bars)
    if unknown:
        raise DataError(f"samples: bar {min(unknown)} is not in the rig; add a [[bar]] with its length")
    ends = samples.columns["bar_end"][rows]
    out: list[Length] = []
    stood: list[tuple[int, Floats]] = []
    for a, b in bar_pairs(rows, bar[rows], ends):
        number = int(bar[a])
        ends_m = tips_m[[a, b]]
        apart = [_apart_m(ends_m, other_m) if n == number else np.inf for n, other_m in stood]
        if not apart or min(apart) > SAME_PLACE_M:
            stood.append((number, ends_m))
            apart.append(0.0)
        measured_m = float(np.linalg.norm(tips_m[b] - tips_m[a]))
        out.append(Length(number, int(np.argmin(apart)) + 1, rig.bars[number].length_m, measured_m))
    return tuple(out)


def _apart_m(ends_m: Floats, other_m: Floats) -> float:
    """Of the end that is farther from where it was; a bar put there the other way round stands in the same place."""
    ways = (other_m, other_m[::-1])
    return min(float(np.linalg.norm(ends_m - way, axis=1).max()) for way in ways)
