"""Makes the mechanisms of joints, links and base from what was found."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibeam.simulation.found import FoundEffect
from calibrate.model.effects.fixture_moved import CARRIED, ONE_BODY
from calibrate.model.effects.hand_force import FORCE_N
from calibrate.model.effects.term import Shape
from calibrate.model.effects.time_laws import FOR_A_WHILE
from simulators.arm.kinematics import Vector
from simulators.arm.statics import Load, Weight, carried_by, loaded_by
from simulators.defects import Defect
from simulators.defects.base import CarriedBase
from simulators.defects.defect import as_vector
from simulators.defects.displacement import CarriedPart, Course
from simulators.defects.drive import (
    GearRunout,
    PayloadOnSoftJoint,
    PressedJoint,
    TwoSlopeFlexspline,
)
from simulators.defects.encoder import OvalRing
from simulators.defects.fixture import CarriedCones, CarriedFixture, CarriedTable, MovedCone
from simulators.defects.link import FlatLink, WornBearing, cantilever
from simulators.defects.tracker import CarriedDevice

Floats = NDArray[np.float64]
WHEEL_M = 0.05  # pitch radius of the wheel of a simulated gear; only runout over radius shows
FRICTION_WIDTH = 1.4  # of the smooth turn-over's torque: a straight turn-over that differs from it least
LEAST = 1e-12  # of a size or a stiffness that another quantity is divided by
PARALLEL = 0.1  # sine between a link and the next joint's axis
NOWHERE: Vector = (0.0, 0.0, 0.0)
ZERO = np.zeros(3)


def size_and_direction(values: Floats) -> tuple[float, Floats]:
    size = max(float(np.linalg.norm(values)), LEAST)
    return size, values / size


# --- joints


def make_ring(f: FoundEffect) -> Defect:
    lobes = f.term.order or 2
    return OvalRing(f.number, lobes * f.size("amplitude_rad"), -(f.size("phase_rad") + math.pi) / lobes, lobes)


def make_of_unknown_period(f: FoundEffect) -> Defect:
    sine, cosine = f.coefficients
    order = f.size("order_per_turn")
    return GearRunout(f.number, math.hypot(sine, cosine) * WHEEL_M, order, 0.0, -math.atan2(cosine, sine))


def make_two_slopes(f: FoundEffect) -> Defect:
    below = max(f.size("compliance_rad_nm"), LEAST)
    return TwoSlopeFlexspline(f.number, below, f.size("compliance_above_rad_nm") / below, f.size("knee_nm"))


def make_pressed(f: FoundEffect) -> Defect:
    size, along = size_and_direction(f.coefficients)
    point = f.session.predictor.rig.tool.point_m or NOWHERE
    return PressedJoint(f.number, size, as_vector(FORCE_N * along), point)


def make_payload(f: FoundEffect) -> Defect:
    if len(f.coefficients) == 1:
        return PayloadOnSoftJoint(f.number, f.size("compliance_rad_nm"))
    soft = float(f.coefficients[0])
    soft = soft if abs(soft) > LEAST else LEAST
    return PayloadOnSoftJoint(f.number, soft, as_vector(f.coefficients[1:] / soft))


def friction_nm(f: FoundEffect) -> float:
    known = "turning_torque_nm" in f.sizes
    return FRICTION_WIDTH * (f.size("turning_torque_nm") if known else f.size("turning_torque_share") * f.largest_nm)


# --- links and base


def make_wobble(f: FoundEffect) -> Defect:
    cycles = (f.term.order or 1) * (1 if f.variant == "with the joint" else -1)
    offset_rad = float(f.session.arm.zero_rad[f.number - 1])
    bearing_rad = 0.5 * math.pi - f.size("phase_rad") - cycles * offset_rad
    return WornBearing(f.number, f.size("amplitude_rad"), cycles, bearing_rad)


def length_m(f: FoundEffect) -> float:
    return float(np.linalg.norm(f.session.arm.fixed[f.number, :3, 3]))


def make_flat(f: FoundEffect) -> Defect:
    end, length = f.session.arm.fixed[f.number], length_m(f)
    along = end[:3, 3] / length
    across = np.cross(along, end[:3, 2])
    if np.linalg.norm(across) < PARALLEL:
        across = np.cross(along, end[:3, 0])
    u, v = f.size("compliance_u_rad_nm") / length, f.size("compliance_v_rad_nm") / length
    return FlatLink(f.number, u, v, as_vector(across / np.linalg.norm(across)))


def course_of(f: FoundEffect) -> tuple[Course, float, float]:
    """Course, moment and duration on the session's clock."""
    if f.thermometer:
        return "warmth", 0.0, 1.0
    if f.term.shape is Shape.STEP and "until_s" in f.sizes:
        return "while", f.at_s, f.size("until_s") - f.size("time_s")
    if f.term.shape is Shape.STEP:
        return "step", f.at_s, 1.0
    if f.term.shape is Shape.EXPONENTIAL:
        return "settling", 0.0, f.size("time_constant_s")
    return "steady", 0.0, f.session.length_s


def displaced(
    f: FoundEffect,
    kind: type[CarriedPart],
    shift_m: Floats,
    turn_rad: Floats = ZERO,
    about_m: Floats = ZERO,
    **more: float,
) -> Defect:
    """A part that goes this way in the course of the effect."""
    course, at_s, over_s = course_of(f)
    way = as_vector(shift_m), as_vector(turn_rad), as_vector(about_m)
    return kind(*way, course, at_s, over_s, f.thermometer, **more)


def carried(f: FoundEffect, pose: Floats, sense: float, kind: type[CarriedPart], **more: float) -> Defect:
    """The six of a motion about the middle of what was reached, in a part's own frame `pose`."""
    turn = pose[:3, :3].T
    six = np.zeros(6)
    six[: len(f.coefficients)] = sense * f.coefficients
    return displaced(f, kind, turn @ six[:3], turn @ six[3:], f.session.own(pose, f.session.middle_m), **more)


def make_base(f: FoundEffect) -> Defect:
    """The effect moves what stands around the arm."""
    return carried(f, np.eye(4), -1.0, CarriedBase)


def make_device(f: FoundEffect) -> Defect:
    return carried(f, np.asarray(f.session.predictor.T_base_device), 1.0, CarriedDevice)


def make_fixture(f: FoundEffect) -> Defect:
    if f.variant == ONE_BODY:
        return carried(f, np.eye(4), 1.0, CarriedTable)
    place = int(f.variant.removeprefix("place ").removesuffix(CARRIED))
    until_s = taken_away_s(f, place) if f.variant.endswith(CARRIED) else np.inf
    return carried(f, f.session.light.places[place - 1], 1.0, CarriedFixture, place=place, until_s=until_s)


def taken_away_s(f: FoundEffect, place: int) -> float:
    """On the session's clock, when the station was next another after a knock."""
    spots, t_s = f.session.drivers.light, f.session.drivers.t_s
    if spots is None or spots.place is None:
        return np.inf
    after = t_s[spots.seen & (spots.place != place) & (t_s >= f.size("time_s"))]
    return float(after.min(initial=np.inf)) - f.session.start_s


def make_cones(f: FoundEffect) -> Defect:
    """All on one plate; or one that came back, whose place within the plate stays."""
    seat = f.variant.removeprefix("seat ").removesuffix(FOR_A_WHILE).removesuffix(", ")
    return carried(f, np.eye(4), 1.0, CarriedCones, cone=int(seat) if seat.isdigit() else 0)


def make_cone(f: FoundEffect) -> Defect:
    size, along = size_and_direction(f.coefficients)
    return MovedCone(int(f.variant.removeprefix("seat ")), size, as_vector(along), f.at_s)


# --- weights that load a spring as was found, where masses are not known or were corrected
#
# The effect is linear in masses and first moments (Atkeson, An, Hollerbach, Int. J. Robotics Research 5(3), 1986), and
# so is the mechanism: least squares of the one in the other over the session, the smallest weights that do it.

Weights = tuple[tuple[Weight, ...], float]  # and the compliance towards the payload
Felt = Callable[[tuple[Floats, Floats]], Floats]  # moment and force at the start of a link -> (row, k)
CENTRE_M = 0.1  # first moments are sought as masses at this distance
WEAKEST = 1e-8  # of the strongest: a combination of weights that shows less is none


def spring_weights(found: FoundEffect) -> Weights:
    """Of a soft joint."""
    joint = found.number
    return _fitted(found, joint, joint, lambda at: at[0][:, 2:], found.turn_rad()[:, np.newaxis])


def beam_weights(found: FoundEffect) -> Weights:
    """Of a link that bends, by the slope and the sag at its end."""
    link, session = found.number, found.session
    end = session.arm.fixed[link]
    length_m = float(np.linalg.norm(end[:3, 3]))

    def felt(at: tuple[Floats, Floats]) -> Floats:
        return np.concatenate(cantilever(end[:3, 3], *at), axis=1) / length_m

    slope = found.amount[:, 3:]
    sag = found.amount[:, :3] - np.cross(slope, [0.0, 0.0, session.beyond_m[link]])
    return _fitted(found, link, link + 1, felt, np.concatenate([sag @ end[:3, :3].T, slope @ end[:3, :3].T], axis=1))


def pedestal_weights(found: FoundEffect) -> Weights:
    """Of a soft pedestal. The effect turns what stands around it."""
    return _fitted(found, 0, 1, lambda at: at[0][:, :2], -found.amount[:, 3:5])


def _fitted(found: FoundEffect, link: int, first: int, felt: Felt, wanted: Floats) -> Weights:
    """Weights of the bodies from `first` on that make `wanted` (row, k) of what is felt at the start of `link`."""
    session = found.session
    load, n = session.load, session.drivers.n_joints
    bodies = [Weight(body, 1.0, (0.0, 0.0, 0.0)) for body in range(first, n + 1)]
    bodies += [Weight(body, 0.0, _moment(axis)) for body in range(first, n + 1) for axis in range(3)]
    columns = [felt(loaded_by(load, [body], link)).ravel() for body in bodies]
    carries = bool(np.ptp(session.payload_kg) > 0.0)
    if carries:
        columns.append(felt(_payload(found, load, link)).ravel())
    sizes, *_ = np.linalg.lstsq(np.stack(columns, axis=1), wanted.ravel(), rcond=WEAKEST)
    weights = tuple(_times(body, float(size)) for body, size in zip(bodies, sizes, strict=False))
    return weights, float(sizes[-1]) if carries else 0.0


def _payload(found: FoundEffect, load: Load, link: int) -> tuple[Floats, Floats]:
    return carried_by(load, found.session.payload_kg, found.session.payload_com_m, link)


def _moment(axis: int) -> tuple[float, float, float]:
    x, y, z = (CENTRE_M * np.eye(3)[axis]).tolist()
    return x, y, z


def _times(body: Weight, size: float) -> Weight:
    x, y, z = (size * m for m in body.moment)
    return Weight(body.body, size * body.mass, (x, y, z))
