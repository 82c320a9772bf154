"""From an effect of a model to a mechanism of the simulators: one line an effect, in `TABLE`.

An effect is a regressor, a mechanism is what is physically wrong. What crosses over is a quantity with a unit and a
meaning of its own: a stiffness in rad/Nm, a distance between two centres in m, an expansion in 1/K. The simulators work
out by themselves what that does; tests/calibeam/simulation holds one against the other over the whole catalogue.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calibeam.simulation.found import FoundEffect
from calibeam.simulation.of_arm import (
    beam_weights,
    carried,
    length_m,
    make_cone,
    make_device,
    make_eccentric,
    make_fixture,
    make_flat,
    make_hardening,
    make_heated,
    make_of_unknown_period,
    make_payload,
    make_pressed,
    make_ring,
    make_runout,
    make_slip,
    make_two_slopes,
    make_under_weight,
    make_warming,
    make_wobble,
    pedestal_weights,
    spring_weights,
)
from calibeam.simulation.of_instruments import (
    CUBES,
    SQUARES,
    half_m,
    layer,
    make_bracket,
    make_circle,
    make_curve,
    make_drum,
    make_hanging,
    make_leaning,
    make_mount,
    make_moved_laser,
    make_pointing,
    make_scale,
    make_spring_mount,
    make_strained,
    make_stray,
    make_target,
    make_walking,
    make_waves,
)
from calibrate.effects.ports import Place
from calibrate.effects.psd_cover_glass import INDEX
from calibrate.effects.second_encoders import AGAINST, PAST, SECOND
from calibrate.effects.term import Shape
from calibrate.sensors.catalogue import kind_of
from calibrate.sensors.kind import Trait
from simulators.defects import Defect
from simulators.defects.base import CarriedBase, PedestalUnderWeights, SoftPedestal, UnevenPedestal
from simulators.defects.detector import (
    CoverGlass,
    Pincushion,
    StrainedFace,
    StrayLight,
    UnevenLayer,
    WavesOnFace,
    WrongGain,
)
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
from simulators.defects.encoder import EccentricDisc, EncoderSlip, OvalRing, SlowFilter, StaleReading
from simulators.defects.fixture import CarriedFixture, MovedCone
from simulators.defects.found_curve import CurveAtJoints
from simulators.defects.link import (
    BeamUnderWeights,
    BendingLink,
    FlatLink,
    HeatedLink,
    WarmArm,
    WarmingUp,
    WornBearing,
)
from simulators.defects.tool import CarriedLaser, CarriedTarget, ElasticMount, LaserWarmUp, SaggingMount, WarmLaser
from simulators.defects.tracker import (
    CarriedDevice,
    ChangingScale,
    CircleOffCentre,
    DrumOutOfRound,
    TrackerScale,
)
from simulators.replayed import Sited, Where

SITES: dict[str, Where] = {"": "", SECOND: "second", AGAINST: "motor", PAST: "past"}


class NoMechanismError(LookupError):
    """An effect that no line of the table takes."""


@dataclass(frozen=True)
class Line:
    """One line of the table; `within` is the share of the effect's size by which the two may differ."""

    physics: str
    form: str  # which of the effect's forms, for a person
    takes: Callable[[FoundEffect], bool]
    mechanism: type[Defect]
    crosses: str  # what crosses over, with its unit
    make: Callable[[FoundEffect], Defect]
    within: float = 0.02
    differs: str = ""  # why, where it is more than two per cent, or what else a reader should know


def mechanism_of(found: FoundEffect) -> Sited:
    """NoMechanismError where no line takes it, or its drivers are none that the simulators follow."""
    line = line_of(found)
    try:
        return Sited(line.make(found), _site(found))
    except KeyError as missing:
        raise NoMechanismError(f"its driver {missing.args[0]} is unknown to the simulation") from missing


def line_of(found: FoundEffect) -> Line:
    """NoMechanismError where no line takes it."""
    for line in TABLE:
        if line.physics == found.term.physics and line.takes(found):
            return line
    raise NoMechanismError("no mechanism of the simulation is of this form")


def at_the_end(mechanism: Defect) -> Defect:
    """What something that happened at some moment has left behind: it has happened from the start."""
    changed: Any = mechanism
    return replace(changed, at_s=-math.inf) if hasattr(changed, "at_s") else mechanism


def _site(found: FoundEffect) -> Where:
    if found.port.instrument and found.port.place is Place.READING and not found.place:
        kind = kind_of(found.port.instrument)
        return "camera" if Trait.DEVICE in kind.traits and "camera" in kind.reads[0] else ""
    return SITES[found.place]


# --- the table


def _any(f: FoundEffect) -> bool:
    return True


def _has(*names: str) -> Callable[[FoundEffect], bool]:
    return lambda f: all(name in f.sizes for name in names)


def _named(*variants: str) -> Callable[[FoundEffect], bool]:
    return lambda f: f.variant in variants


def _shaped(shape: Shape, variant: str | None = None) -> Callable[[FoundEffect], bool]:
    return lambda f: f.term.shape is shape and (variant is None or f.variant == variant)


UNSTATED = ("masses corrected", "unknown masses")
TABLE: tuple[Line, ...] = (
    Line(
        "encoder-eccentricity",
        "once a turn",
        _any,
        EccentricDisc,
        "distance of the disc's centre from its shaft, m (amplitude times radius), and its bearing, rad",
        make_eccentric,
    ),
    Line(
        "encoder-harmonic",
        "two to four times a turn",
        _any,
        OvalRing,
        ("largest radius of the ring over its mean radius less 1 (order times amplitude), and its bearing, rad"),
        make_ring,
    ),
    Line(
        "gear-transmission-error",
        "at the mesh",
        _any,
        GearRunout,
        "runout of the pinion, m (amplitude times the radius of the wheel), ratio, and bearing, rad",
        make_runout,
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
        make_pressed,
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
        make_two_slopes,
    ),
    Line(
        "joint-compliance",
        "stiffening",
        _shaped(Shape.CUBIC),
        HardeningSpring,
        "compliance at rest, rad/Nm, and its cubic part, rad/Nm³",
        make_hardening,
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
        make_payload,
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
        make_under_weight,
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
        make_slip,
    ),
    Line(
        "axis-wobble",
        "all of it",
        _any,
        WornBearing,
        "lean of the axis, rad, lobes a turn, bearing, rad",
        make_wobble,
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
        make_flat,
    ),
    Line(
        "link-bending",
        "as stiff all round",
        _any,
        BendingLink,
        "1/(EI), 1/(Nm²) (compliance over length)",
        lambda f: BendingLink(f.number, f.size("compliance_rad_nm") / length_m(f), light=True),
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
        lambda f: make_warming(f, 1, f.session.drivers.n_joints),
    ),
    Line(
        "link-thermal-growth",
        "one link, by temperature",
        lambda f: bool(f.thermometer),
        HeatedLink,
        "expansion, 1/K, and thermometer",
        make_heated,
    ),
    Line(
        "link-thermal-growth",
        "one link, over time",
        _any,
        WarmingUp,
        "growth in the end, no unit, and time constant, s",
        lambda f: make_warming(f, f.number, f.number),
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
        lambda f: carried(f, np.eye(4), -1.0, CarriedBase),
    ),
    Line(
        "device-drift",
        "all of it",
        _any,
        CarriedDevice,
        "shift, m, and turn, rad, of the device in its own frame, moment, duration or thermometer",
        make_device,
    ),
    Line(
        "tool-sag",
        "bracket",
        lambda f: f.variant.startswith("bracket, overhang"),
        SaggingMount,
        "lean when the overhang is level, rad",
        make_bracket,
    ),
    Line(
        "tool-sag",
        "towards gravity",
        _named("towards gravity"),
        SaggingMount,
        "lean when the beam is level, rad, about the laser",
        make_leaning,
    ),
    Line(
        "tool-sag",
        "mount of any shape",
        _named("mount of any shape"),
        ElasticMount,
        "turn for one weight along x, y, z of the flange, rad",
        make_mount,
    ),
    Line("tool-sag", "hanging", _named("hanging"), ElasticMount, "shift for one weight, m", make_hanging),
    Line(
        "tool-sag",
        "bracket of any shape",
        _any,
        ElasticMount,
        "shift for one weight along x, y, z of the flange, m",
        make_spring_mount,
    ),
    Line(
        "laser-warm-up",
        "of the direction",
        lambda f: f.port.where.endswith("direction"),
        LaserWarmUp,
        "turn in the end, rad, its axis, and time constant, s",
        make_pointing,
    ),
    Line("laser-warm-up", "of the origin", _any, CarriedLaser, "shift in the end, m, time constant, s", make_walking),
    Line(
        "laser-thermal-drift",
        "of the direction",
        lambda f: f.port.where.endswith("direction"),
        WarmLaser,
        "turn, rad/K, its axis, and thermometer",
        make_pointing,
    ),
    Line("laser-thermal-drift", "of the origin", _any, CarriedLaser, "shift, m/K, and thermometer", make_walking),
    Line(
        "laser-moved",
        "all of it",
        _any,
        CarriedLaser,
        "shift, m, and turn, rad, of the housing across its beam, and moment",
        make_moved_laser,
    ),
    Line(
        "tool-moved", "all of it", _any, CarriedTarget, "shift on the flange, m, moment or time constant", make_target
    ),
    Line(
        "fixture-moved",
        "all of it",
        _any,
        CarriedFixture,
        "shift, m, and turn, rad, of the fixture in its own frame, moment or duration",
        make_fixture,
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
        make_strained,
    ),
    Line(
        "psd-nonlinearity",
        "radial",
        _shaped(Shape.RADIAL),
        Pincushion,
        "distortion at the edge, no unit",
        lambda f: Pincushion(f.number, f.size("edge_share"), half_m(f)),
    ),
    Line(
        "psd-nonlinearity",
        "cubic",
        _shaped(Shape.CUBIC),
        UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: layer(f, ((0, 3, 0), (1, 0, 3))),
    ),
    Line(
        "psd-nonlinearity",
        "quadratic",
        _any,
        UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: layer(f, [(a, *p) for a in (0, 1) for p in SQUARES]),
    ),
    Line(
        "psd-ambient-light",
        "all of it",
        _any,
        StrayLight,
        "sum signal of the foreign light, V, and where it falls, m",
        make_stray,
    ),
    Line(
        "psd-cover-glass",
        "all of it",
        _any,
        CoverGlass,
        "thickness of the window, m",
        lambda f: CoverGlass(f.number, f.size("thickness_m"), INDEX),
    ),
    Line("seat-moved", "all of it", _any, MovedCone, "shift of the cone, m, and its moment, s", make_cone),
    Line("device-scale", "constant", _has("scale_error_share"), TrackerScale, "excess of scale, no unit", make_scale),
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
        make_drum,
    ),
    Line(
        "device-periodic",
        "of a circle",
        _any,
        CircleOffCentre,
        "error of the circle, rad, times a turn, and phase, rad",
        make_circle,
    ),
    Line(
        "unknown",
        "period unknown",
        _named("period unknown"),
        GearRunout,
        "runout of a pinion that would do it, m, its order, and bearing, rad",
        make_of_unknown_period,
    ),
    Line(
        "unknown",
        "fringes",
        _named("fringes"),
        WavesOnFace,
        "amplitudes, m, phases, rad, waves a metre",
        make_waves,
    ),
    Line(
        "unknown",
        "bent face",
        _named("bent face"),
        UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: layer(f, [(a, *p) for a in (0, 1) for p in CUBES]),
    ),
    Line(
        "unknown",
        "at joints, links, base and instruments",
        _any,
        CurveAtJoints,
        ("the curve that was found, over its driver: rad or m at every sample of the session; beyond them its end"),
        make_curve,
    ),
)
