"""The beam on the two faces: ray, mirror, second face. Plain floats, for it runs once per emulated millisecond.

A face is a square in its sensor's xy plane; light counts when it comes from the side of the outward normal z, and the
back of a face stops the beam. The face struck first absorbs part of the power and reflects the rest as a mirror:

    d' = d - 2 (d . n) n        (law of reflection in vector form; Hecht, "Optics", section 4.3)

What it does not imitate: spot size and its cut at the edge, diffuse light, the cover glass, and a third incidence
(the faces of the fixture stand so that a twice reflected beam leaves them).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from scipy.spatial.transform import Rotation

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
