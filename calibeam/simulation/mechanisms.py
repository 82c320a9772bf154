"""From an effect of a model to a mechanism of the simulators: one line an effect, in `TABLE`.

An effect is a regressor, a mechanism is what is physically wrong. What crosses over is a quantity with a unit and a
meaning of its own: a stiffness in rad/Nm, a distance between two centres in m, an expansion in 1/K. The simulators work
out by themselves what that does; tests/calibeam/simulation holds one against the other over the whole catalogue.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibeam.simulation.found import Found
from calibeam.simulation.weights import beam_weights, pedestal_weights, spring_weights
from calibrate.effects.hand_force import FORCE_N
from calibrate.effects.laser_pointing import beam_axes
from calibrate.effects.ports import Place
from calibrate.effects.psd_cover_glass import INDEX
from calibrate.effects.second_encoders import AGAINST, PAST, SECOND
from calibrate.effects.term import Shape
from calibrate.effects.tool_sag import PAIRS
from calibrate.sensors.catalogue import kind_of
from calibrate.sensors.kind import Trait
from simulators.arm.drawing import origin_and_rotation
from simulators.arm.rigid import Vector
from simulators.defects import Defect
from simulators.defects.base import CarriedBase, PedestalUnderWeights, SoftPedestal, UnevenPedestal
from simulators.defects.curve import CurveAtBase, CurveAtJoints, CurveAtLink, CurveInReading
from simulators.defects.defect import as_vector
from simulators.defects.detector import (
    CoverGlass,
    Pincushion,
    StrainedFace,
    StrayLight,
    UnevenLayer,
    WavesOnFace,
    WrongGain,
)
from simulators.defects.displacement import Carried, Course
from simulators.defects.drive import (
    CoupledWrist,
    GearRunout,
    HardeningSpring,
    LateClock,
    PayloadOnSoftJoint,
    PressedJoint,
    SlackDrive,
    SlackUnderWeight,
    SoftJoint,
    SpringUnderWeights,
    TwoSlopeFlexspline,
    Unsettled,
    WrongRatio,
)
from simulators.defects.encoder import RADIUS_M, EccentricDisc, EncoderSlip, OvalRing, SlowFilter, StaleReading
from simulators.defects.fixture import CarriedFixture, MovedCone
from simulators.defects.link import (
    BeamUnderWeights,
    BendingLink,
    FlatLink,
    HeatedLink,
    WarmArm,
    WarmingUp,
    WornBearing,
)
from simulators.defects.tool import CarriedLaser, ElasticMount, LaserWarmUp, SaggingMount, WarmLaser
from simulators.defects.tracker import (
    CarriedDevice,
    ChangingScale,
    CircleOffCentre,
    DrumOutOfRound,
    TrackerScale,
    WireScale,
)
from simulators.replayed import Sited, Where

Floats = NDArray[np.float64]
WHEEL_M = 0.05  # pitch radius of the wheel of a simulated gear; only runout over radius shows
FRICTION_WIDTH = 1.4  # of the smooth turn-over's torque: a straight turn-over that differs from it least
LEAST = 1e-9  # of a share or a stiffness that another quantity is divided by
PARALLEL = 0.1  # sine between a link and the next joint's axis
NOWHERE: Vector = (0.0, 0.0, 0.0)
SITES: dict[str, Where] = {"": "", SECOND: "second", AGAINST: "motor", PAST: "past"}


class NoMechanismError(LookupError):
    """An effect that no line of the table takes."""


@dataclass(frozen=True)
class Line:
    """One line of the table; `within` is the share of the effect's size by which the two may differ."""

    physics: str
    form: str  # which of the effect's forms, for a person
    takes: Callable[[Found], bool]
    mechanism: type[Defect]
    crosses: str  # what crosses over, with its unit
    make: Callable[[Found], Defect]
    within: float = 0.02
    differs: str = ""  # why, where it is more than two per cent, or what else a reader should know


def mechanism_of(found: Found) -> Sited:
    """NoMechanismError where no line takes it, or its drivers are none that the simulators follow."""
    line = line_of(found)
    try:
        return Sited(line.make(found), _site(found))
    except KeyError as missing:
        raise NoMechanismError(f"its driver {missing.args[0]} is unknown to the simulation") from missing


def line_of(found: Found) -> Line:
    """NoMechanismError where no line takes it."""
    for line in TABLE:
        if line.physics == found.term.physics and line.takes(found):
            return line
    raise NoMechanismError("no mechanism of the simulation is of this form")


def at_the_end(mechanism: Defect) -> Defect:
    """What something that happened at some moment has left behind: it has happened from the start."""
    changed: Any = mechanism
    return replace(changed, at_s=-math.inf) if hasattr(changed, "at_s") else mechanism


def _site(found: Found) -> Where:
    if found.port.instrument and found.port.place is Place.READING and not found.place:
        kind = kind_of(found.port.instrument)
        return "camera" if Trait.DEVICE in kind.traits and "camera" in kind.reads[0] else ""
    return SITES[found.place]


# --- joints


def _eccentric(f: Found) -> Defect:
    return EccentricDisc(f.number, f.size("amplitude_rad") * RADIUS_M, -f.size("phase_rad"))


def _ring(f: Found) -> Defect:
    lobes = f.term.order or 2
    return OvalRing(f.number, lobes * f.size("amplitude_rad"), -(f.size("phase_rad") + math.pi) / lobes, lobes)


def _runout(f: Found) -> Defect:
    return GearRunout(f.number, f.size("amplitude_rad") * WHEEL_M, f.size("order_per_turn"), 0.0, -f.size("phase_rad"))


def _of_unknown_period(f: Found) -> Defect:
    sine, cosine = f.coefficients
    order = f.size("order_per_turn")
    return GearRunout(f.number, math.hypot(sine, cosine) * WHEEL_M, order, 0.0, -math.atan2(cosine, sine))


def _two_slopes(f: Found) -> Defect:
    below = max(f.size("compliance_rad_nm"), LEAST * 1e-3)
    return TwoSlopeFlexspline(f.number, below, f.size("compliance_above_rad_nm") / below, f.size("knee_nm"))


def _hardening(f: Found) -> Defect:
    change = f.size("compliance_change_rad_nm") / f.largest_nm**2
    return HardeningSpring(f.number, f.size("compliance_at_rest_rad_nm"), change)


def _pressed(f: Found) -> Defect:
    push = FORCE_N * f.coefficients
    size = max(float(np.linalg.norm(f.coefficients)), LEAST * 1e-3)
    point = f.session.predictor.rig.tool.point_m or NOWHERE
    return PressedJoint(f.number, size, as_vector(push / size), point)


def _payload(f: Found) -> Defect:
    if len(f.coefficients) == 1:
        return PayloadOnSoftJoint(f.number, f.size("compliance_rad_nm"))
    soft = float(f.coefficients[0])
    soft = soft if abs(soft) > LEAST * 1e-3 else LEAST * 1e-3
    return PayloadOnSoftJoint(f.number, soft, as_vector(f.coefficients[1:] / soft))


def _under_weight(f: Found) -> Defect:
    known = "turning_torque_nm" in f.sizes
    turns_nm = f.size("turning_torque_nm") if known else f.size("turning_torque_share") * f.largest_nm
    return SlackUnderWeight(f.number, f.size("play_rad"), FRICTION_WIDTH * turns_nm)


def _slip(f: Found) -> Defect:
    return EncoderSlip(f.number, -f.size("slip_rad"), f.size("time_s") - f.session.start_s)


# --- links and base


def _wobble(f: Found) -> Defect:
    cycles = (f.term.order or 1) * (1 if f.variant == "with the joint" else -1)
    offset_rad = float(f.session.arm.zero_rad[f.number - 1])
    bearing_rad = 0.5 * math.pi - f.size("phase_rad") - cycles * offset_rad
    return WornBearing(f.number, f.size("amplitude_rad"), cycles, bearing_rad)


def _length_m(f: Found) -> float:
    return float(np.linalg.norm(f.session.arm.fixed[f.number, :3, 3]))


def _flat(f: Found) -> Defect:
    end, length = f.session.arm.fixed[f.number], _length_m(f)
    along = end[:3, 3] / length
    across = np.cross(along, end[:3, 2])
    if np.linalg.norm(across) < PARALLEL:
        across = np.cross(along, end[:3, 0])
    u, v = f.size("compliance_u_rad_nm") / length, f.size("compliance_v_rad_nm") / length
    return FlatLink(f.number, u, v, as_vector(across / np.linalg.norm(across)))


def _heated(f: Found) -> Defect:
    return HeatedLink(f.number, f.size("expansion_per_k"), f.thermometer)


def _warming(f: Found, first: int, last: int) -> Defect:
    return WarmingUp(first, last, f.size("growth_share"), f.size("time_constant_s"))


def _course(f: Found) -> tuple[Course, float, float]:
    """Course, moment and duration on the session's clock."""
    if f.thermometer:
        return "warmth", 0.0, 1.0
    if f.term.shape is Shape.STEP:
        return "step", f.size("time_s") - f.session.start_s, 1.0
    if f.term.shape is Shape.EXPONENTIAL:
        return "settling", 0.0, f.size("time_constant_s")
    return "steady", 0.0, f.session.length_s


def _carried(f: Found, pose: Floats, sense: float, kind: type[Carried], **more: int) -> Defect:
    """The six of a motion about the middle of what was reached, in a part's own frame `pose`."""
    turn = pose[:3, :3].T
    six = np.zeros(6)
    six[: len(f.coefficients)] = sense * f.coefficients
    course, at_s, over_s = _course(f)
    about = f.session.own(pose, f.session.middle_m)
    shift, spin = as_vector(turn @ six[:3]), as_vector(turn @ six[3:])
    return kind(shift, spin, as_vector(about), course, at_s, over_s, f.thermometer, **more)


def _device(f: Found) -> Defect:
    return _carried(f, np.asarray(f.session.predictor.T_base_device), 1.0, CarriedDevice)


def _fixture(f: Found) -> Defect:
    place = int(f.variant.removeprefix("place "))
    return _carried(f, f.session.light.places[place - 1], 1.0, CarriedFixture, place=place)


def _cone(f: Found) -> Defect:
    size = max(float(np.linalg.norm(f.coefficients)), LEAST * 1e-3)
    cone, at_s = int(f.variant.removeprefix("seat ")), f.size("time_s") - f.session.start_s
    return MovedCone(cone, size, as_vector(f.coefficients / size), at_s)


# --- tool and laser


def _bracket(f: Found) -> Defect:
    tool = f.session.predictor.rig.tool
    tip = tool.laser_origin_m if f.port.where.startswith("laser") else tool.point_m
    overhang = np.array(tool.com_m if f.variant.endswith("centre of mass") else tip)
    at_laser = f.port.where.startswith("laser")
    return SaggingMount(f.size("sag_rad"), as_vector(overhang / np.linalg.norm(overhang)), at_laser)


def _leaning(f: Found) -> Defect:
    direction = np.array(f.session.predictor.rig.tool.laser_direction)
    foot = f.session.predictor.rig.tool.laser_origin_m or NOWHERE
    return SaggingMount(f.size("sag_rad"), as_vector(direction / np.linalg.norm(direction)), True, foot)


def _matrix(values: Floats) -> tuple[Vector, Vector, Vector]:
    return as_vector(values[0]), as_vector(values[1]), as_vector(values[2])


def _mount(f: Found) -> Defect:
    origin, u, v = beam_axes(f.session.drivers)
    by = f.coefficients.reshape(2, 3)
    turn = np.asarray(np.outer(u, by[0]) + np.outer(v, by[1]), dtype=np.float64)
    return ElasticMount(_matrix(np.zeros((3, 3))), _matrix(turn), as_vector(origin), True)


def _hanging(f: Found) -> Defect:
    return ElasticMount(_matrix(f.size("sag_m") * np.eye(3)), _matrix(np.zeros((3, 3))), NOWHERE, False)


def _spring_mount(f: Found) -> Defect:
    shift = np.zeros((3, 3))
    for (i, j), value in zip(PAIRS, f.coefficients, strict=True):
        shift[i, j] = shift[j, i] = value
    return ElasticMount(_matrix(shift), _matrix(np.zeros((3, 3))), NOWHERE, False)


def _across(f: Found) -> tuple[float, Vector, Vector]:
    """Size, direction and origin of what happens along two axes across the beam."""
    origin, u, v = beam_axes(f.session.drivers)
    both = f.coefficients[0] * u + f.coefficients[1] * v
    size = max(float(np.linalg.norm(both)), LEAST * 1e-3)
    return size, as_vector(both / size), as_vector(origin)


def _pointing(f: Found) -> Defect:
    size, axis, at_m = _across(f)
    if f.thermometer:
        return WarmLaser(size, axis, at_m, f.thermometer)
    return LaserWarmUp(size, f.size("time_constant_s"), axis, at_m)


def _walking(f: Found) -> Defect:
    size, along, _ = _across(f)
    course, at_s, over_s = _course(f)
    shift = as_vector(size * np.array(along))
    return CarriedLaser(shift, NOWHERE, NOWHERE, course, at_s, over_s, f.thermometer)


# --- detectors


def _half_m(f: Found) -> float:
    return f.session.light.half_size_m


def _strained(f: Found) -> Defect:
    x, y = (f.sizes.get(f"gain_{axis}_error_share", 0.0) for axis in "xy")
    return StrainedFace(f.number, x, y, f.sizes.get("cross_share", 0.0))


def _layer(f: Found, powers: Sequence[tuple[int, int, int]]) -> Defect:
    """`powers`: axis, i, j of each coefficient, in order."""
    sizes = tuple((a, i, j, float(c)) for (a, i, j), c in zip(powers, f.coefficients, strict=True))
    return UnevenLayer(f.number, sizes, _half_m(f))


SQUARES = ((2, 0), (1, 1), (0, 2))
CUBES = ((3, 0), (2, 1), (1, 2), (0, 3))


def _waves(f: Found) -> Defect:
    sx, cx, sy, cy = f.coefficients
    waves = (f.size("waves_x_per_m"), f.size("waves_y_per_m"))
    amplitudes = (math.hypot(sx, cx), math.hypot(sy, cy))
    return WavesOnFace(f.number, amplitudes, (math.atan2(cx, sx), math.atan2(cy, sy)), waves)


def _stray(f: Found) -> Defect:
    pull_x_m, pull_y_m, share = f.coefficients
    share = share if abs(share) > LEAST else LEAST
    total = f.session.drivers.psd_sum_v
    middle_v = 1.0 if total is None else float(np.median(total[:, f.number - 1]))
    return StrayLight(f.number, float(share * middle_v), (float(pull_x_m / share), float(pull_y_m / share)))


# --- devices


def _is_drum(f: Found) -> bool:
    return Trait.DRUM in kind_of(f.port.instrument).traits


def _scale(f: Found) -> Defect:
    return (WireScale if _is_drum(f) else TrackerScale)(f.size("scale_error_share"))


def _drum(f: Found) -> Defect:
    radius_m = f.size("period_m") / (2.0 * math.pi)
    bearing_rad = f.size("phase_rad") + math.pi
    return DrumOutOfRound(f.size("amplitude_m"), radius_m, bearing_rad, -bearing_rad * radius_m)


def _circle(f: Found) -> Defect:
    which = "azimuth" if f.variant == "azimuth" else "elevation"
    return CircleOffCentre(which, f.term.order or 1, f.size("amplitude_rad"), f.size("phase_rad"))


# --- what has no name


def _rows(values: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in values.tolist())


def _curve(f: Found) -> Defect:
    by, knots, amounts = tuple(",".join(f.term.depends_on).split(",")), _rows(f.knots()), _rows(f.amount)
    match f.port.place:
        case Place.JOINTS:
            return CurveAtJoints(by, knots, amounts)
        case Place.SURROUNDINGS:
            return CurveAtBase(by, knots, amounts)
        case Place.FRAME:
            return _at_frame(f, by, knots, amounts)
        case Place.READING:
            return _in_reading(f, by, knots, amounts)


def _at_frame(
    f: Found, by: tuple[str, ...], knots: tuple[tuple[float, ...], ...], amounts: tuple[tuple[float, ...], ...]
) -> Defect:
    end = f.session.arm.fixed[f.port.index].copy()
    end[:3, 3] += f.session.beyond_m[f.port.index] * end[:3, 2]
    origin_m, rotation_rad = origin_and_rotation(end)
    return CurveAtLink(by, knots, amounts, 1.0, f.port.index, origin_m, rotation_rad)


def _in_reading(
    f: Found, by: tuple[str, ...], knots: tuple[tuple[float, ...], ...], amounts: tuple[tuple[float, ...], ...]
) -> Defect:
    if f.place:
        joints = f.session.drivers.readouts[f.port.instrument].joints
        whole = np.zeros((len(amounts), f.session.drivers.n_joints))
        whole[:, [joint - 1 for joint in joints]] = np.asarray(amounts)
        return CurveAtJoints(by, knots, _rows(whole))
    traits = kind_of(f.port.instrument).traits
    if Trait.LIGHT in traits:
        return CurveInReading(by, knots, amounts, 1.0, "spots")
    return CurveInReading(by, knots, amounts, 1.0, "length" if Trait.DRUM in traits else "position")


# --- the table


def _any(f: Found) -> bool:
    return True


def _has(*names: str) -> Callable[[Found], bool]:
    return lambda f: all(name in f.sizes for name in names)


def _named(*variants: str) -> Callable[[Found], bool]:
    return lambda f: f.variant in variants


def _shaped(shape: Shape, variant: str | None = None) -> Callable[[Found], bool]:
    return lambda f: f.term.shape is shape and (variant is None or f.variant == variant)


UNSTATED = ("masses corrected", "unknown masses")
TABLE: tuple[Line, ...] = (
    Line(
        "encoder-eccentricity",
        "once a turn",
        _any,
        EccentricDisc,
        "distance of the disc's centre from its shaft, m (amplitude times radius), and its bearing, rad",
        _eccentric,
    ),
    Line(
        "encoder-harmonic",
        "two to four times a turn",
        _any,
        OvalRing,
        ("largest radius of the ring over its mean radius less 1 (order times amplitude), and its bearing, rad"),
        _ring,
    ),
    Line(
        "gear-transmission-error",
        "at the mesh",
        _any,
        GearRunout,
        "runout of the pinion, m (amplitude times the radius of the wheel), ratio, and bearing, rad",
        _runout,
    ),
    Line(
        "gear-ratio-error",
        "all of it",
        _any,
        WrongRatio,
        "excess of the ratio, no unit",
        lambda f: WrongRatio(f.number, f.size("scale_error_rad_per_rad")),
    ),
    Line(
        "joint-coupling",
        "all of it",
        _any,
        CoupledWrist,
        "share of the other joint's turn, no unit",
        lambda f: CoupledWrist(f.number, f.other_joint, f.size("coupling_rad_per_rad")),
    ),
    Line(
        "joint-compliance",
        "hand force",
        _named("hand force"),
        PressedJoint,
        "compliance of the joint, rad/Nm, and force of the hand, N, in the flange's axes",
        _pressed,
    ),
    Line(
        "joint-compliance",
        "masses corrected; unknown masses",
        _named(*UNSTATED),
        SpringUnderWeights,
        "masses and first moments times compliance, kg rad/Nm and kg m rad/Nm, that load it as was found",
        lambda f: SpringUnderWeights(f.number, *spring_weights(f)),
    ),
    Line(
        "joint-compliance",
        "with a knee",
        _named("knee"),
        TwoSlopeFlexspline,
        "compliance below and above the knee, rad/Nm, and the knee, Nm",
        _two_slopes,
    ),
    Line(
        "joint-compliance",
        "stiffening",
        _shaped(Shape.CUBIC),
        HardeningSpring,
        "compliance at rest, rad/Nm, and its cubic part, rad/Nm³",
        _hardening,
    ),
    Line(
        "joint-compliance",
        "linear",
        _any,
        SoftJoint,
        "compliance, rad/Nm",
        lambda f: SoftJoint(f.number, f.size("compliance_rad_nm")),
    ),
    Line(
        "payload-compliance",
        "all of it",
        _any,
        PayloadOnSoftJoint,
        "compliance, rad/Nm, and where it was found the payload's centre of mass, m",
        _payload,
    ),
    Line(
        "backlash",
        "by approach",
        lambda f: f.driver.startswith("approach"),
        SlackDrive,
        "play between the flanks, rad",
        lambda f: SlackDrive(f.number, f.size("play_rad")),
    ),
    Line(
        "backlash",
        "by weight",
        _any,
        SlackUnderWeight,
        "play between the flanks, rad, and friction, Nm (1.4 times the effect's turn-over)",
        _under_weight,
        0.15,
        "friction lets the joint go over from flank to flank along a straight line, the effect along a "
        "smooth curve; beyond the turn-over they agree",
    ),
    Line(
        "reading-lag",
        "of the last move",
        lambda f: f.driver.startswith("last_move"),
        SlowFilter,
        ("share of the last move that the filter has not passed on, no unit (the effect's with the other sign)"),
        lambda f: SlowFilter(f.number, -f.size("lag_share")),
    ),
    Line(
        "reading-lag",
        "of the command",
        _any,
        StaleReading,
        "share of the following error, no unit",
        lambda f: StaleReading(f.number, f.size("lag_share")),
    ),
    Line(
        "not-settled",
        "all of it",
        _any,
        Unsettled,
        "share of the last move that is left, no unit",
        lambda f: Unsettled(f.size("left_share"), f.session.drivers.n_joints),
    ),
    Line(
        "latency",
        "all of it",
        _any,
        LateClock,
        "delay, s",
        lambda f: LateClock(f.size("delay_s"), f.session.drivers.n_joints),
    ),
    Line(
        "encoder-slip",
        "all of it",
        _any,
        EncoderSlip,
        "slip of the reading, rad (the effect's with the other sign), and its moment, s",
        _slip,
    ),
    Line(
        "axis-wobble", "all of it", _any, WornBearing, "lean of the axis, rad, lobes a turn, and bearing, rad", _wobble
    ),
    Line(
        "link-bending",
        "masses corrected; unknown masses",
        _named(*UNSTATED),
        BeamUnderWeights,
        "masses and first moments times L/(EI), kg rad/Nm and kg m rad/Nm, that bend it as was found",
        lambda f: BeamUnderWeights(f.number, *beam_weights(f)),
    ),
    Line(
        "link-bending",
        "each way its own",
        _named("each way its own"),
        FlatLink,
        "1/(EI) about two axes across the link, 1/(Nm²)",
        _flat,
    ),
    Line(
        "link-bending",
        "as stiff all round",
        _any,
        BendingLink,
        "1/(EI), 1/(Nm²) (compliance over length)",
        lambda f: BendingLink(f.number, f.size("compliance_rad_nm") / _length_m(f), light=True),
    ),
    Line(
        "link-thermal-growth",
        "whole arm, by temperature",
        lambda f: f.variant == "whole arm" and bool(f.thermometer),
        WarmArm,
        "expansion, 1/K, and thermometer",
        lambda f: WarmArm(f.size("expansion_per_k"), f.session.drivers.n_joints, f.thermometer, 1),
    ),
    Line(
        "link-thermal-growth",
        "whole arm, over time",
        _named("whole arm"),
        WarmingUp,
        "growth in the end, no unit, and time constant, s",
        lambda f: _warming(f, 1, f.session.drivers.n_joints),
    ),
    Line(
        "link-thermal-growth",
        "one link, by temperature",
        lambda f: bool(f.thermometer),
        HeatedLink,
        "expansion, 1/K, and thermometer",
        _heated,
    ),
    Line(
        "link-thermal-growth",
        "one link, over time",
        _any,
        WarmingUp,
        "growth in the end, no unit, and time constant, s",
        lambda f: _warming(f, f.number, f.number),
    ),
    Line(
        "base-compliance",
        "masses corrected; unknown masses",
        _named(*UNSTATED),
        PedestalUnderWeights,
        "masses and first moments times compliance, kg rad/Nm and kg m rad/Nm, that tilt it as was found",
        lambda f: PedestalUnderWeights(*pedestal_weights(f)),
    ),
    Line(
        "base-compliance",
        "each way its own",
        _named("each way its own"),
        UnevenPedestal,
        "compliance about x and y, rad/Nm",
        lambda f: UnevenPedestal(f.size("compliance_x_rad_nm"), f.size("compliance_y_rad_nm")),
    ),
    Line(
        "base-compliance",
        "as stiff all round",
        _any,
        SoftPedestal,
        "compliance, rad/Nm",
        lambda f: SoftPedestal(f.size("compliance_rad_nm")),
    ),
    Line(
        "base-moved",
        "all of it",
        _any,
        CarriedBase,
        "shift, m, and turn, rad, of the foot (the effect's with the other sign: it moves what stands "
        "around), moment, duration or thermometer",
        lambda f: _carried(f, np.eye(4), -1.0, CarriedBase),
    ),
    Line(
        "device-drift",
        "all of it",
        _any,
        CarriedDevice,
        "shift, m, and turn, rad, of the device in its own frame, moment, duration or thermometer",
        _device,
    ),
    Line(
        "tool-sag",
        "bracket",
        lambda f: f.variant.startswith("bracket, overhang"),
        SaggingMount,
        "lean when the overhang is level, rad",
        _bracket,
    ),
    Line(
        "tool-sag",
        "towards gravity",
        _named("towards gravity"),
        SaggingMount,
        "lean when the beam is level, rad, about the laser",
        _leaning,
    ),
    Line(
        "tool-sag",
        "mount of any shape",
        _named("mount of any shape"),
        ElasticMount,
        "turn for one weight along x, y, z of the flange, rad",
        _mount,
    ),
    Line("tool-sag", "hanging", _named("hanging"), ElasticMount, "shift for one weight, m", _hanging),
    Line(
        "tool-sag",
        "bracket of any shape",
        _any,
        ElasticMount,
        "shift for one weight along x, y, z of the flange, m",
        _spring_mount,
    ),
    Line(
        "laser-warm-up",
        "of the direction",
        lambda f: f.port.where.endswith("direction"),
        LaserWarmUp,
        "turn in the end, rad, its axis, and time constant, s",
        _pointing,
    ),
    Line("laser-warm-up", "of the origin", _any, CarriedLaser, "shift in the end, m, and time constant, s", _walking),
    Line(
        "laser-thermal-drift",
        "of the direction",
        lambda f: f.port.where.endswith("direction"),
        WarmLaser,
        "turn, rad/K, its axis, and thermometer",
        _pointing,
    ),
    Line("laser-thermal-drift", "of the origin", _any, CarriedLaser, "shift, m/K, and thermometer", _walking),
    Line(
        "fixture-moved",
        "all of it",
        _any,
        CarriedFixture,
        "shift, m, and turn, rad, of the fixture in its own frame, moment or duration",
        _fixture,
    ),
    Line(
        "psd-gain",
        "both axes alike",
        _has("gain_error_share"),
        WrongGain,
        "excess of the scale, no unit",
        lambda f: WrongGain(f.number, f.size("gain_error_share"), 1.0),
    ),
    Line(
        "psd-gain",
        "each axis; skew",
        _any,
        StrainedFace,
        "strain along x and y and shear of the picture, no unit",
        _strained,
    ),
    Line(
        "psd-nonlinearity",
        "radial",
        _shaped(Shape.RADIAL),
        Pincushion,
        "distortion at the edge, no unit",
        lambda f: Pincushion(f.number, f.size("edge_share"), _half_m(f)),
    ),
    Line(
        "psd-nonlinearity",
        "cubic",
        _shaped(Shape.CUBIC),
        UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: _layer(f, ((0, 3, 0), (1, 0, 3))),
    ),
    Line(
        "psd-nonlinearity",
        "quadratic",
        _any,
        UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: _layer(f, [(a, *p) for a in (0, 1) for p in SQUARES]),
    ),
    Line(
        "psd-ambient-light",
        "all of it",
        _any,
        StrayLight,
        "sum signal of the foreign light, V, and where it falls, m",
        _stray,
    ),
    Line(
        "psd-cover-glass",
        "all of it",
        _any,
        CoverGlass,
        "thickness of the window, m",
        lambda f: CoverGlass(f.number, f.size("thickness_m"), INDEX),
    ),
    Line("seat-moved", "all of it", _any, MovedCone, "shift of the cone, m, and its moment, s", _cone),
    Line("device-scale", "constant", _has("scale_error_share"), TrackerScale, "excess of the scale, no unit", _scale),
    Line(
        "device-scale",
        "with range",
        _has("scale_change_per_m"),
        ChangingScale,
        "change of the scale, 1/m",
        lambda f: ChangingScale(per_m=f.size("scale_change_per_m")),
    ),
    Line(
        "device-scale",
        "with the square of range",
        _has("scale_change_per_m_per_m"),
        ChangingScale,
        "change of the scale, 1/m²",
        lambda f: ChangingScale(per_m2=f.size("scale_change_per_m_per_m")),
    ),
    Line(
        "device-scale",
        "with temperature",
        _any,
        ChangingScale,
        "change of the scale, 1/K, and thermometer",
        lambda f: ChangingScale(per_k=f.size("scale_share_per_k"), where=f.thermometer),
    ),
    Line(
        "device-periodic",
        "of a drum",
        _has("period_m"),
        DrumOutOfRound,
        ("distance of the drum's centre from its shaft, m, its radius, m (period over 2π), and bearing, rad"),
        _drum,
    ),
    Line(
        "device-periodic",
        "of a circle",
        _any,
        CircleOffCentre,
        "error of the circle, rad, times a turn, and phase, rad",
        _circle,
    ),
    Line(
        "unknown",
        "period unknown",
        _named("period unknown"),
        GearRunout,
        "runout of a pinion that would do it, m, its order, and bearing, rad",
        _of_unknown_period,
    ),
    Line("unknown", "fringes", _named("fringes"), WavesOnFace, "amplitudes, m, phases, rad, and waves a metre", _waves),
    Line(
        "unknown",
        "bent face",
        _named("bent face"),
        UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: _layer(f, [(a, *p) for a in (0, 1) for p in CUBES]),
    ),
    Line(
        "unknown",
        "at joints, links, base and instruments",
        _any,
        CurveAtJoints,
        ("the curve that was found, over its driver: rad or m at every sample of the session; beyond them its end"),
        _curve,
    ),
)
