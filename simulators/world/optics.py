"""The beam on the two faces, and the four currents of each face with their noise.

Ray, mirror, second face in plain floats, for it runs once per emulated millisecond. A face is a square in its sensor's
xy plane; light counts when it comes from the side of the outward normal z, and the back of a face stops the beam. The
face struck first absorbs part of the power and reflects the rest as a mirror:

    d' = d - 2 (d . n) n        (law of reflection in vector form; Hecht, "Optics", section 4.3)

What it does not imitate: spot size and its cut at the edge, diffuse light, the cover glass, and a third incidence (the
faces of the fixture stand so that a twice reflected beam leaves them).

Currents of a duo-lateral detector:

    X1 + X2 = Y1 + Y2 = S = responsivity * absorbed power
    x = (L/2) (X2 - X1) / (X1 + X2),   y likewise,   L the length of the face

Source: On-Trak Photonics, "PSD theory", duo-lateral type (sign as in the DAQ protocol: X2 grows with x).

Noise: what limits a spot in a workshop is not the amplifier but air and vibration, hence noise of position, the same at
any brightness. One current with sigma s moves the position by (L/2)/S sqrt(2 (1 + u^2)) s with u = x / (L/2), so each
current gets s = psd_noise S / ((L/2) sqrt(2 (1 + u^2))), which is also how an amplifier behind an automatic range
behaves. White in time: sigma grows with the root of the sampling rate. A dark face has the noise of its amplifier.

Currents are computed only when a device samples; a straight line between two knots (one a physics step) is exact for a
spot that moves evenly (at 1 rad/s and 1 m it bends by less than 1 µm in a millisecond) and shows a beam that runs off a
face as a short fall of the sum.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.world.model import STEP_S
from simulators.world.rig import Fixture, Pose, Vector

# Bare silicon reflects ((3.87 - 1) / (3.87 + 1))^2 = 0.35 at 635 nm (index: Green, Sol. Energy Mater. Sol. Cells 92
# (2008) 1305); its passivation takes a little away.
REFLECTIVITY = 0.3


class Ray(NamedTuple):
    """Origin (m) and unit direction, in the base frame."""

    x_m: float
    y_m: float
    z_m: float
    dx: float
    dy: float
    dz: float


class Spot(NamedTuple):
    """Light on a face: place in the sensor's own frame and absorbed power as a share of the laser's."""

    x_m: float
    y_m: float
    share: float


@dataclass(frozen=True)
class Face:
    """One sensor's sensitive square in the base frame."""

    centre_m: Vector
    axis_x: Vector
    axis_y: Vector
    normal: Vector
    half_size_m: float


@dataclass(frozen=True)
class Spots:
    """What both sensors see; None: no light. `first`: 1 or 2, the face struck first, 0 when none counts."""

    psd1: Spot | None
    psd2: Spot | None
    first: int


DARK = Spots(None, None, 0)


class _Incidence(NamedTuple):
    distance_m: float
    x_m: float
    y_m: float
    cosine: float  # beam against outward normal: negative when light comes from the front


def place_faces(fixture: Fixture, psd1_in_base: Pose) -> tuple[Face, Face]:
    """Both faces of a fixture whose PSD 1 stands at the given pose."""
    turned = Rotation.from_rotvec(psd1_in_base.rotation_rad)
    second = fixture.psd2_in_psd1
    origin_m = turned.apply(second.origin_m) + psd1_in_base.origin_m
    turned_second = turned * Rotation.from_rotvec(second.rotation_rad)
    return (
        _face(psd1_in_base.origin_m, turned, fixture.half_size_m),
        _face((float(origin_m[0]), float(origin_m[1]), float(origin_m[2])), turned_second, fixture.half_size_m),
    )


def _face(centre_m: Vector, turned: Rotation, half_size_m: float) -> Face:
    x, y, z = (tuple(column) for column in turned.as_matrix().T.tolist())
    return Face(centre_m, x, y, z, half_size_m)


def trace(beam: Ray, faces: tuple[Face, Face]) -> Spots:
    """Follows the beam to the face it meets first and, reflected, to the other."""
    hits = [meet(beam, face) for face in faces]
    struck = [k for k in (0, 1) if hits[k] is not None]
    if not struck:
        return DARK
    first = min(struck, key=lambda k: hits[k].distance_m)  # pyright: ignore[reportOptionalMemberAccess]
    hit = hits[first]
    if hit is None or hit.cosine > 0.0:
        return DARK
    spots: list[Spot | None] = [None, None]
    spots[first] = Spot(hit.x_m, hit.y_m, 1.0 - REFLECTIVITY)
    onward = meet(reflect(beam, faces[first], hit.distance_m), faces[1 - first])
    if onward is not None and onward.cosine < 0.0:
        spots[1 - first] = Spot(onward.x_m, onward.y_m, REFLECTIVITY * (1.0 - REFLECTIVITY))
    return Spots(spots[0], spots[1], first + 1)


def meet(ray: Ray, face: Face) -> _Incidence | None:
    """Where a ray meets the square of a face, from either side; None when it passes by, runs away or grazes."""
    nx, ny, nz = face.normal
    cosine = ray.dx * nx + ray.dy * ny + ray.dz * nz
    if cosine == 0.0:
        return None
    cx, cy, cz = face.centre_m
    distance_m = ((cx - ray.x_m) * nx + (cy - ray.y_m) * ny + (cz - ray.z_m) * nz) / cosine
    if distance_m <= 0.0:
        return None
    px = ray.x_m + distance_m * ray.dx - cx
    py = ray.y_m + distance_m * ray.dy - cy
    pz = ray.z_m + distance_m * ray.dz - cz
    x_m = px * face.axis_x[0] + py * face.axis_x[1] + pz * face.axis_x[2]
    y_m = px * face.axis_y[0] + py * face.axis_y[1] + pz * face.axis_y[2]
    if not (math.fabs(x_m) <= face.half_size_m and math.fabs(y_m) <= face.half_size_m):
        return None
    return _Incidence(distance_m, x_m, y_m, cosine)


def reflect(ray: Ray, face: Face, distance_m: float) -> Ray:
    """The ray that a face sends on from the point at `distance_m` along the incoming one."""
    nx, ny, nz = face.normal
    twice = 2.0 * (ray.dx * nx + ray.dy * ny + ray.dz * nz)
    return Ray(
        ray.x_m + distance_m * ray.dx,
        ray.y_m + distance_m * ray.dy,
        ray.z_m + distance_m * ray.dz,
        ray.dx - twice * nx,
        ray.dy - twice * ny,
        ray.dz - twice * nz,
    )


Floats = NDArray[np.float64]
RESPONSIVITY_A_W = 0.4  # silicon at 635 nm; On-Trak duo-lateral data sheets, typical curve
SATURATION_A = 500e-6  # an electrode's current ends here: range of the DAQ's transimpedance stage, above 1 mW full on
DARK_NOISE_A = 2e-9  # sigma of one sample at 1 kHz in the dark; a few ppm of the range
NOISE_RATE_HZ = 1000.0  # the rate for which psd_noise_m and DARK_NOISE_A are stated
ELECTRODES = 8  # psd1 x1, x2, y1, y2, psd2 x1, x2, y1, y2


class Photodetectors:
    """Both detectors of a fixture: spots to mean currents and their noise, those to samples."""

    def __init__(self, half_size_m: float, laser_power_w: float, noise_m: float) -> None:
        self._half_size_m = half_size_m
        self._full_a = RESPONSIVITY_A_W * laser_power_w
        self._noise_of_range = noise_m / (half_size_m * math.sqrt(2.0))

    def see(self, spots: Spots) -> Floats:
        """(2, 8) A: mean currents, and the sigma of one sample of each at NOISE_RATE_HZ."""
        first_a, first_sigma_a = self._four(spots.psd1)
        second_a, second_sigma_a = self._four(spots.psd2)
        return np.array((first_a + second_a, first_sigma_a + second_sigma_a))

    def _four(self, spot: Spot | None) -> tuple[list[float], list[float]]:
        """Means and sigmas of x1, x2, y1, y2."""
        if spot is None or self._full_a == 0.0:
            return [0.0] * 4, [DARK_NOISE_A] * 4
        half_a = 0.5 * self._full_a * spot.share
        u, v = spot.x_m / self._half_size_m, spot.y_m / self._half_size_m
        sigma_a = 2.0 * half_a * self._noise_of_range
        along_x_a, along_y_a = sigma_a / math.sqrt(1.0 + u * u), sigma_a / math.sqrt(1.0 + v * v)
        return (
            [half_a * (1.0 - u), half_a * (1.0 + u), half_a * (1.0 - v), half_a * (1.0 + v)],
            [along_x_a, along_x_a, along_y_a, along_y_a],
        )


def sample_a(seen: Floats, rate_hz: float, rng: np.random.Generator, count: int | None = None) -> Floats:
    """Noisy, clipped currents (sample, 8) A for what was seen, (sample, 2, 8) A; draws 8 numbers a sample, in order.

    With a `count`, `seen` is (1, 2, 8) and all samples see the same.
    """
    noisy_a = rng.standard_normal((len(seen) if count is None else count, ELECTRODES))
    noisy_a *= (rate_hz / NOISE_RATE_HZ) ** 0.5 * seen[:, 1]
    noisy_a += seen[:, 0]
    np.maximum(noisy_a, -SATURATION_A, out=noisy_a)
    return np.minimum(noisy_a, SATURATION_A, out=noisy_a)


EDGE_S = 1e-9  # rounding of times that are multiples of a sampling interval
ON_KNOT = EDGE_S / STEP_S


class Knot:
    """The beam at one physics step; what the detectors see of it, (2, 8) A, is found once."""

    __slots__ = ("_seen", "beam")

    def __init__(self, beam: Ray) -> None:
        self.beam = beam
        self._seen: Floats | None = None

    def seen(self, see: Callable[[Ray], Floats]) -> Floats:
        if self._seen is None:
            self._seen = see(self.beam)
        return self._seen


def interpolate(knots: list[Knot], start_s: float, times_s: list[float], see: Callable[[Ray], Floats]) -> Floats:
    """Mean currents and their sigma at times, (sample, 2, 8) A; the last knot holds on for as long as the arm stands.

    A loop, because a tick has a few samples only and most of them fall on a knot.
    """
    return np.array([_at((time_s - start_s) / STEP_S, knots, see) for time_s in times_s])


def _at(place: float, knots: list[Knot], see: Callable[[Ray], Floats]) -> Floats:
    before = int(place + ON_KNOT)
    if before >= len(knots) - 1:
        return knots[-1].seen(see)
    share = place - before
    if share <= ON_KNOT:
        return knots[before].seen(see)
    return (1.0 - share) * knots[before].seen(see) + share * knots[before + 1].seen(see)
