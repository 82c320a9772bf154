"""Makes the mechanisms of joints, links and base from what was found."""

import math

import numpy as np
from numpy.typing import NDArray

from calibeam.simulation.found import Found
from calibrate.effects.hand_force import FORCE_N
from calibrate.effects.term import Shape
from simulators.arm.rigid import Vector
from simulators.defects import Defect
from simulators.defects.defect import as_vector
from simulators.defects.displacement import Carried, Course
from simulators.defects.drive import (
    GearRunout,
    HardeningSpring,
    PayloadOnSoftJoint,
    PressedJoint,
    SlackUnderWeight,
    TwoSlopeFlexspline,
)
from simulators.defects.encoder import RADIUS_M, EccentricDisc, EncoderSlip, OvalRing
from simulators.defects.fixture import CarriedFixture, MovedCone
from simulators.defects.link import (
    FlatLink,
    HeatedLink,
    WarmingUp,
    WornBearing,
)
from simulators.defects.tracker import (
    CarriedDevice,
)

Floats = NDArray[np.float64]
WHEEL_M = 0.05  # pitch radius of the wheel of a simulated gear; only runout over radius shows
FRICTION_WIDTH = 1.4  # of the smooth turn-over's torque: a straight turn-over that differs from it least
LEAST = 1e-9  # of a share or a stiffness that another quantity is divided by
PARALLEL = 0.1  # sine between a link and the next joint's axis
NOWHERE: Vector = (0.0, 0.0, 0.0)


# --- joints


def make_eccentric(f: Found) -> Defect:
    return EccentricDisc(f.number, f.size("amplitude_rad") * RADIUS_M, -f.size("phase_rad"))


def make_ring(f: Found) -> Defect:
    lobes = f.term.order or 2
    return OvalRing(f.number, lobes * f.size("amplitude_rad"), -(f.size("phase_rad") + math.pi) / lobes, lobes)


def make_runout(f: Found) -> Defect:
    return GearRunout(f.number, f.size("amplitude_rad") * WHEEL_M, f.size("order_per_turn"), 0.0, -f.size("phase_rad"))


def make_of_unknown_period(f: Found) -> Defect:
    sine, cosine = f.coefficients
    order = f.size("order_per_turn")
    return GearRunout(f.number, math.hypot(sine, cosine) * WHEEL_M, order, 0.0, -math.atan2(cosine, sine))


def make_two_slopes(f: Found) -> Defect:
    below = max(f.size("compliance_rad_nm"), LEAST * 1e-3)
    return TwoSlopeFlexspline(f.number, below, f.size("compliance_above_rad_nm") / below, f.size("knee_nm"))


def make_hardening(f: Found) -> Defect:
    change = f.size("compliance_change_rad_nm") / f.largest_nm**2
    return HardeningSpring(f.number, f.size("compliance_at_rest_rad_nm"), change)


def make_pressed(f: Found) -> Defect:
    push = FORCE_N * f.coefficients
    size = max(float(np.linalg.norm(f.coefficients)), LEAST * 1e-3)
    point = f.session.predictor.rig.tool.point_m or NOWHERE
    return PressedJoint(f.number, size, as_vector(push / size), point)


def make_payload(f: Found) -> Defect:
    if len(f.coefficients) == 1:
        return PayloadOnSoftJoint(f.number, f.size("compliance_rad_nm"))
    soft = float(f.coefficients[0])
    soft = soft if abs(soft) > LEAST * 1e-3 else LEAST * 1e-3
    return PayloadOnSoftJoint(f.number, soft, as_vector(f.coefficients[1:] / soft))


def make_under_weight(f: Found) -> Defect:
    known = "turning_torque_nm" in f.sizes
    turns_nm = f.size("turning_torque_nm") if known else f.size("turning_torque_share") * f.largest_nm
    return SlackUnderWeight(f.number, f.size("play_rad"), FRICTION_WIDTH * turns_nm)


def make_slip(f: Found) -> Defect:
    return EncoderSlip(f.number, -f.size("slip_rad"), f.size("time_s") - f.session.start_s)


# --- links and base


def make_wobble(f: Found) -> Defect:
    cycles = (f.term.order or 1) * (1 if f.variant == "with the joint" else -1)
    offset_rad = float(f.session.arm.zero_rad[f.number - 1])
    bearing_rad = 0.5 * math.pi - f.size("phase_rad") - cycles * offset_rad
    return WornBearing(f.number, f.size("amplitude_rad"), cycles, bearing_rad)


def length_m(f: Found) -> float:
    return float(np.linalg.norm(f.session.arm.fixed[f.number, :3, 3]))


def make_flat(f: Found) -> Defect:
    end, length = f.session.arm.fixed[f.number], length_m(f)
    along = end[:3, 3] / length
    across = np.cross(along, end[:3, 2])
    if np.linalg.norm(across) < PARALLEL:
        across = np.cross(along, end[:3, 0])
    u, v = f.size("compliance_u_rad_nm") / length, f.size("compliance_v_rad_nm") / length
    return FlatLink(f.number, u, v, as_vector(across / np.linalg.norm(across)))


def make_heated(f: Found) -> Defect:
    return HeatedLink(f.number, f.size("expansion_per_k"), f.thermometer)


def make_warming(f: Found, first: int, last: int) -> Defect:
    return WarmingUp(first, last, f.size("growth_share"), f.size("time_constant_s"))


def course_of(f: Found) -> tuple[Course, float, float]:
    """Course, moment and duration on the session's clock."""
    if f.thermometer:
        return "warmth", 0.0, 1.0
    if f.term.shape is Shape.STEP:
        return "step", f.size("time_s") - f.session.start_s, 1.0
    if f.term.shape is Shape.EXPONENTIAL:
        return "settling", 0.0, f.size("time_constant_s")
    return "steady", 0.0, f.session.length_s


def carried(f: Found, pose: Floats, sense: float, kind: type[Carried], **more: int) -> Defect:
    """The six of a motion about the middle of what was reached, in a part's own frame `pose`."""
    turn = pose[:3, :3].T
    six = np.zeros(6)
    six[: len(f.coefficients)] = sense * f.coefficients
    course, at_s, over_s = course_of(f)
    about = f.session.own(pose, f.session.middle_m)
    shift, spin = as_vector(turn @ six[:3]), as_vector(turn @ six[3:])
    return kind(shift, spin, as_vector(about), course, at_s, over_s, f.thermometer, **more)


def make_device(f: Found) -> Defect:
    return carried(f, np.asarray(f.session.predictor.T_base_device), 1.0, CarriedDevice)


def make_fixture(f: Found) -> Defect:
    place = int(f.variant.removeprefix("place "))
    return carried(f, f.session.light.places[place - 1], 1.0, CarriedFixture, place=place)


def make_cone(f: Found) -> Defect:
    size = max(float(np.linalg.norm(f.coefficients)), LEAST * 1e-3)
    cone, at_s = int(f.variant.removeprefix("seat ")), f.size("time_s") - f.session.start_s
    return MovedCone(cone, size, as_vector(f.coefficients / size), at_s)
