"""Makes the mechanisms of tool, laser, detectors and devices from what was found, and those that have no name."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibeam.simulation.found import FoundEffect
from calibeam.simulation.of_arm import NOWHERE, displaced, size_and_direction
from calibrate.model.effects.laser_pointing import (
    beam_axes,
)
from calibrate.model.effects.moved import (
    line_of,
)
from calibrate.model.effects.ports import (
    Place,
)
from calibrate.model.effects.tool_sag import (
    PAIRS,
)
from calibrate.model.sensors.catalogue import (
    kind_of,
)
from calibrate.model.sensors.kind import (
    Trait,
)
from simulators.arm.drawing import origin_and_rotation
from simulators.arm.kinematics import Vector
from simulators.defects import Defect
from simulators.defects.defect import as_vector
from simulators.defects.detector import StrainedFace, StrayLight, WavesOnFace
from simulators.defects.found_curve import CurveAtBase, CurveAtJoints, CurveAtLink, CurveInReading
from simulators.defects.tool import CarriedLaser, CarriedTarget, ElasticMount, LaserWarmUp, SaggingMount, WarmLaser
from simulators.defects.tracker import DrumOutOfRound, TrackerScale, WireScale

Floats = NDArray[np.float64]
LEAST = 1e-9  # of a share of foreign light, which the place of it is divided by


# --- tool and laser


def make_bracket(f: FoundEffect) -> Defect:
    tool = f.session.predictor.rig.tool
    tip = tool.laser_origin_m if f.port.where.startswith("laser") else tool.point_m
    overhang = np.array(tool.com_m if f.variant.endswith("centre of mass") else tip)
    at_laser = f.port.where.startswith("laser")
    return SaggingMount(f.size("sag_rad"), as_vector(overhang / np.linalg.norm(overhang)), at_laser)


def make_leaning(f: FoundEffect) -> Defect:
    direction = np.array(f.session.predictor.rig.tool.laser_direction)
    foot = f.session.predictor.rig.tool.laser_origin_m or NOWHERE
    return SaggingMount(f.size("sag_rad"), as_vector(direction / np.linalg.norm(direction)), True, foot)


def matrix(values: Floats) -> tuple[Vector, Vector, Vector]:
    return as_vector(values[0]), as_vector(values[1]), as_vector(values[2])


def make_mount(f: FoundEffect) -> Defect:
    origin, u, v = beam_axes(f.session.drivers)
    by = f.coefficients.reshape(2, 3)
    turn = np.asarray(np.outer(u, by[0]) + np.outer(v, by[1]), dtype=np.float64)
    return ElasticMount(matrix(np.zeros((3, 3))), matrix(turn), as_vector(origin), True)


def make_hanging(f: FoundEffect) -> Defect:
    return ElasticMount(matrix(f.size("sag_m") * np.eye(3)), matrix(np.zeros((3, 3))), NOWHERE, False)


def make_spring_mount(f: FoundEffect) -> Defect:
    shift = np.zeros((3, 3))
    for (i, j), value in zip(PAIRS, f.coefficients, strict=True):
        shift[i, j] = shift[j, i] = value
    return ElasticMount(matrix(shift), matrix(np.zeros((3, 3))), NOWHERE, False)


def across(f: FoundEffect) -> tuple[float, Vector, Vector]:
    """Size, direction and origin of what happens along two axes across the beam."""
    origin, u, v = beam_axes(f.session.drivers)
    both = f.coefficients[0] * u + f.coefficients[1] * v
    size, along = size_and_direction(both)
    return size, as_vector(along), as_vector(origin)


def make_pointing(f: FoundEffect) -> Defect:
    size, axis, at_m = across(f)
    if f.thermometer:
        return WarmLaser(size, axis, at_m, f.thermometer)
    return LaserWarmUp(size, f.size("time_constant_s"), axis, at_m)


def make_walking(f: FoundEffect) -> Defect:
    size, along, _ = across(f)
    return displaced(f, CarriedLaser, size * np.array(along))


def make_target(f: FoundEffect) -> Defect:
    return displaced(f, CarriedTarget, f.coefficients)


def make_moved_laser(f: FoundEffect) -> Defect:
    """Two small turns and shifts of one body add up; the turns are about the origin of the beam."""
    twist = line_of(f.session.drivers) @ f.coefficients
    origin = np.array(f.session.predictor.rig.tool.laser_origin_m or NOWHERE)
    return displaced(f, CarriedLaser, twist[:3] + np.cross(twist[3:], origin), twist[3:], origin)


# --- detectors


def make_strained(f: FoundEffect) -> Defect:
    x, y = (f.sizes.get(f"gain_{axis}_error_share", 0.0) for axis in "xy")
    return StrainedFace(f.number, x, y, f.sizes.get("cross_share", 0.0))


def powers(*of_place: tuple[int, int, int]) -> Callable[[FoundEffect], tuple[tuple[int, int, int, float], ...]]:
    """`of_place`: axis and the powers of x and y of each coefficient, in order."""
    return lambda f: tuple((*one, float(c)) for one, c in zip(of_place, f.coefficients, strict=True))


SQUARES = [(axis, *of_x_y) for axis in (0, 1) for of_x_y in ((2, 0), (1, 1), (0, 2))]
CUBES = [(axis, *of_x_y) for axis in (0, 1) for of_x_y in ((3, 0), (2, 1), (1, 2), (0, 3))]


def make_waves(f: FoundEffect) -> Defect:
    sx, cx, sy, cy = f.coefficients
    waves = (f.size("waves_x_per_m"), f.size("waves_y_per_m"))
    amplitudes = (math.hypot(sx, cx), math.hypot(sy, cy))
    return WavesOnFace(f.number, amplitudes, (math.atan2(cx, sx), math.atan2(cy, sy)), waves)


def make_stray(f: FoundEffect) -> Defect:
    pull_x_m, pull_y_m, share = f.coefficients
    share = share if abs(share) > LEAST else LEAST
    total = f.session.drivers.psd_sum_v
    middle_v = 1.0 if total is None else float(np.median(total[:, f.number - 1]))
    return StrayLight(f.number, float(share * middle_v), (float(pull_x_m / share), float(pull_y_m / share)))


# --- devices


def is_drum(f: FoundEffect) -> bool:
    return Trait.DRUM in kind_of(f.port.instrument).traits


def make_scale(f: FoundEffect) -> Defect:
    return (WireScale if is_drum(f) else TrackerScale)(f.size("scale_error_share"))


def make_drum(f: FoundEffect) -> Defect:
    radius_m = f.size("period_m") / (2.0 * math.pi)
    bearing_rad = f.size("phase_rad") + math.pi
    return DrumOutOfRound(f.size("amplitude_m"), radius_m, bearing_rad, -bearing_rad * radius_m)


# --- what has no name


def rows(values: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in values.tolist())


def make_curve(f: FoundEffect) -> Defect:
    by, knots, amounts = tuple(",".join(f.term.depends_on).split(",")), rows(f.knots()), rows(f.amount)
    match f.port.place:
        case Place.JOINTS:
            return CurveAtJoints(by, knots, amounts)
        case Place.SURROUNDINGS:
            return CurveAtBase(by, knots, amounts)
        case Place.FRAME:
            return at_frame(f, by, knots, amounts)
        case Place.READING:
            return in_reading(f, by, knots, amounts)


def at_frame(
    f: FoundEffect, by: tuple[str, ...], knots: tuple[tuple[float, ...], ...], amounts: tuple[tuple[float, ...], ...]
) -> Defect:
    end = f.session.arm.fixed[f.port.index].copy()
    end[:3, 3] += f.session.beyond_m[f.port.index] * end[:3, 2]
    origin_m, rotation_rad = origin_and_rotation(end)
    return CurveAtLink(by, knots, amounts, 1.0, f.port.index, origin_m, rotation_rad)


def in_reading(
    f: FoundEffect, by: tuple[str, ...], knots: tuple[tuple[float, ...], ...], amounts: tuple[tuple[float, ...], ...]
) -> Defect:
    if f.place:
        joints = f.session.drivers.readouts[f.port.instrument].joints
        whole = np.zeros((len(amounts), f.session.drivers.n_joints))
        whole[:, [joint - 1 for joint in joints]] = np.asarray(amounts)
        return CurveAtJoints(by, knots, rows(whole))
    traits = kind_of(f.port.instrument).traits
    if Trait.LIGHT in traits:
        return CurveInReading(by, knots, amounts, 1.0, "spots")
    return CurveInReading(by, knots, amounts, 1.0, "length" if Trait.DRUM in traits else "position")
