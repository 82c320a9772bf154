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

from calibeam.simulation import of_arm, of_instruments
from calibeam.simulation.found import FoundEffect
from calibrate.model.effects.fixture_moved import ONE_BODY
from calibrate.model.effects.ports import Place
from calibrate.model.effects.psd_cover_glass import INDEX
from calibrate.model.effects.second_encoders import AGAINST, PAST, SECOND
from calibrate.model.effects.term import Shape
from calibrate.model.effects.time_laws import BEHIND, FOR_A_WHILE
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.kind import Trait
from simulators.defects import Defect, base, detector, drive, encoder, fixture, found_curve, link, tool, tracker
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
        encoder.EccentricDisc,
        "distance of the disc's centre from its shaft, m (amplitude times radius), and its bearing, rad",
        of_arm.make_eccentric,
    ),
    Line(
        "encoder-harmonic",
        "two to four times a turn",
        _any,
        encoder.OvalRing,
        ("largest radius of the ring over its mean radius less 1 (order times amplitude), and its bearing, rad"),
        of_arm.make_ring,
    ),
    Line(
        "gear-transmission-error",
        "at the mesh",
        _any,
        drive.GearRunout,
        "runout of the pinion, m (amplitude times the radius of the wheel), ratio, and bearing, rad",
        of_arm.make_runout,
    ),
    Line(
        "gear-ratio-error",
        "all of it",
        _any,
        drive.WrongRatio,
        "excess of the ratio, no unit",
        lambda f: drive.WrongRatio(f.number, f.size("scale_error_rad_per_rad")),
    ),
    Line(
        "joint-coupling",
        "all of it",
        _any,
        drive.CoupledWrist,
        "share of the other joint's turn, no unit",
        lambda f: drive.CoupledWrist(f.number, f.other_joint, f.size("coupling_rad_per_rad")),
    ),
    Line(
        "joint-compliance",
        "hand force",
        _named("hand force"),
        drive.PressedJoint,
        "compliance of the joint, rad/Nm, and force of the hand, N, in the flange's axes",
        of_arm.make_pressed,
    ),
    Line(
        "joint-compliance",
        "masses corrected; unknown masses",
        _named(*UNSTATED),
        drive.SpringUnderWeights,
        "masses and first moments times compliance, kg rad/Nm and kg m rad/Nm, that load it as was found",
        lambda f: drive.SpringUnderWeights(f.number, *of_arm.spring_weights(f)),
    ),
    Line(
        "joint-compliance",
        "with a knee",
        _named("knee"),
        drive.TwoSlopeFlexspline,
        "compliance below and above the knee, rad/Nm, and the knee, Nm",
        of_arm.make_two_slopes,
    ),
    Line(
        "joint-compliance",
        "stiffening",
        _shaped(Shape.CUBIC),
        drive.HardeningSpring,
        "compliance at rest, rad/Nm, and its cubic part, rad/Nm³",
        of_arm.make_hardening,
    ),
    Line(
        "joint-compliance",
        "linear",
        _any,
        drive.SoftJoint,
        "compliance, rad/Nm",
        lambda f: drive.SoftJoint(f.number, f.size("compliance_rad_nm")),
    ),
    Line(
        "payload-compliance",
        "all of it",
        _any,
        drive.PayloadOnSoftJoint,
        "compliance, rad/Nm, and where it was found the payload's centre of mass, m",
        of_arm.make_payload,
    ),
    Line(
        "backlash",
        "by approach",
        lambda f: f.driver.startswith("approach"),
        drive.SlackDrive,
        "play between the flanks, rad",
        lambda f: drive.SlackDrive(f.number, f.size("play_rad")),
    ),
    Line(
        "backlash",
        "by weight",
        _any,
        drive.SlackUnderWeight,
        "play between the flanks, rad, and friction, Nm (1.4 times the effect's turn-over)",
        of_arm.make_under_weight,
        0.15,
        "friction lets the joint go over from flank to flank along a straight line, the effect along a "
        "smooth curve; beyond the turn-over they agree",
    ),
    Line(
        "reading-lag",
        "of the last move",
        lambda f: f.driver.startswith("last_move"),
        encoder.SlowFilter,
        ("share of the last move that the filter has not passed on, no unit (the effect's with the other sign)"),
        lambda f: encoder.SlowFilter(f.number, -f.size("lag_share")),
    ),
    Line(
        "reading-lag",
        "of the command",
        _any,
        encoder.StaleReading,
        "share of the following error, no unit",
        lambda f: encoder.StaleReading(f.number, f.size("lag_share")),
    ),
    Line(
        "not-settled",
        "all of it",
        _any,
        drive.Unsettled,
        "share of the last move that is left, no unit",
        lambda f: drive.Unsettled(f.size("left_share"), f.session.drivers.n_joints),
    ),
    Line(
        "latency",
        "all of it",
        _any,
        drive.LateClock,
        "delay, s",
        lambda f: drive.LateClock(f.size("delay_s"), f.session.drivers.n_joints),
    ),
    Line(
        "encoder-slip",
        "all of it",
        _any,
        encoder.EncoderSlip,
        "slip of the reading, rad (the effect's with the other sign), and its moment, s",
        of_arm.make_slip,
    ),
    Line(
        "axis-wobble",
        "all of it",
        _any,
        link.WornBearing,
        "lean of the axis, rad, lobes a turn, bearing, rad",
        of_arm.make_wobble,
    ),
    Line(
        "link-bending",
        "masses corrected; unknown masses",
        _named(*UNSTATED),
        link.BeamUnderWeights,
        "masses and first moments times L/(EI), kg rad/Nm and kg m rad/Nm, that bend it as was found",
        lambda f: link.BeamUnderWeights(f.number, *of_arm.beam_weights(f)),
    ),
    Line(
        "link-bending",
        "each way its own",
        _named("each way its own"),
        link.FlatLink,
        "1/(EI) about two axes across the link, 1/(Nm²)",
        of_arm.make_flat,
    ),
    Line(
        "link-bending",
        "as stiff all round",
        _any,
        link.BendingLink,
        "1/(EI), 1/(Nm²) (compliance over length)",
        lambda f: link.BendingLink(f.number, f.size("compliance_rad_nm") / of_arm.length_m(f), light=True),
    ),
    Line(
        "link-thermal-growth",
        "whole arm, by temperature",
        lambda f: f.variant == "whole arm" and bool(f.thermometer),
        link.WarmArm,
        "expansion, 1/K, and thermometer",
        lambda f: link.WarmArm(f.size("expansion_per_k"), f.session.drivers.n_joints, f.thermometer, 1),
    ),
    Line(
        "link-thermal-growth",
        "whole arm, over time",
        _named("whole arm"),
        link.WarmingUp,
        "growth in the end, no unit, and time constant, s",
        lambda f: of_arm.make_warming(f, 1, f.session.drivers.n_joints),
    ),
    Line(
        "link-thermal-growth",
        "one link, behind its thermometer",
        _named(BEHIND),
        link.LaggingLink,
        "expansion, 1/K, thermometer, and time constant of the link behind it, s",
        of_arm.make_lagging,
    ),
    Line(
        "link-thermal-growth",
        "one link, by temperature",
        lambda f: bool(f.thermometer),
        link.HeatedLink,
        "expansion, 1/K, and thermometer",
        of_arm.make_heated,
    ),
    Line(
        "link-thermal-growth",
        "one link, over time",
        _any,
        link.WarmingUp,
        "growth in the end, no unit, and time constant, s",
        lambda f: of_arm.make_warming(f, f.number, f.number),
    ),
    Line(
        "base-compliance",
        "masses corrected; unknown masses",
        _named(*UNSTATED),
        base.PedestalUnderWeights,
        "masses and first moments times compliance, kg rad/Nm and kg m rad/Nm, that tilt it as was found",
        lambda f: base.PedestalUnderWeights(*of_arm.pedestal_weights(f)),
    ),
    Line(
        "base-compliance",
        "each way its own",
        _named("each way its own"),
        base.UnevenPedestal,
        "compliance about x and y, rad/Nm",
        lambda f: base.UnevenPedestal(f.size("compliance_x_rad_nm"), f.size("compliance_y_rad_nm")),
    ),
    Line(
        "base-compliance",
        "as stiff all round",
        _any,
        base.SoftPedestal,
        "compliance, rad/Nm",
        lambda f: base.SoftPedestal(f.size("compliance_rad_nm")),
    ),
    Line(
        "base-moved",
        "all of it",
        _any,
        base.CarriedBase,
        "shift, m, and turn, rad, of the foot (the effect's with the other sign: it moves what stands "
        "around), moment, duration or thermometer",
        lambda f: of_arm.carried(f, np.eye(4), -1.0, base.CarriedBase),
    ),
    Line(
        "device-drift",
        "all of it",
        _any,
        tracker.CarriedDevice,
        "shift, m, and turn, rad, of the device in its own frame, moment, duration or thermometer",
        of_arm.make_device,
    ),
    Line(
        "tool-sag",
        "bracket",
        lambda f: f.variant.startswith("bracket, overhang"),
        tool.SaggingMount,
        "lean when the overhang is level, rad",
        of_instruments.make_bracket,
    ),
    Line(
        "tool-sag",
        "towards gravity",
        _named("towards gravity"),
        tool.SaggingMount,
        "lean when the beam is level, rad, about the laser",
        of_instruments.make_leaning,
    ),
    Line(
        "tool-sag",
        "mount of any shape",
        _named("mount of any shape"),
        tool.ElasticMount,
        "turn for one weight along x, y, z of the flange, rad",
        of_instruments.make_mount,
    ),
    Line(
        "tool-sag",
        "hanging",
        _named("hanging"),
        tool.ElasticMount,
        "shift for one weight, m",
        of_instruments.make_hanging,
    ),
    Line(
        "tool-sag",
        "bracket of any shape",
        _any,
        tool.ElasticMount,
        "shift for one weight along x, y, z of the flange, m",
        of_instruments.make_spring_mount,
    ),
    Line(
        "laser-warm-up",
        "of the direction",
        lambda f: f.port.where.endswith("direction"),
        tool.LaserWarmUp,
        "turn in the end, rad, its axis, and time constant, s",
        of_instruments.make_pointing,
    ),
    Line(
        "laser-warm-up",
        "of the origin",
        _any,
        tool.CarriedLaser,
        "shift in the end, m, time constant, s",
        of_instruments.make_walking,
    ),
    Line(
        "laser-thermal-drift",
        "of the direction",
        lambda f: f.port.where.endswith("direction"),
        tool.WarmLaser,
        "turn, rad/K, its axis, and thermometer",
        of_instruments.make_pointing,
    ),
    Line(
        "laser-thermal-drift",
        "of the origin",
        _any,
        tool.CarriedLaser,
        "shift, m/K, and thermometer",
        of_instruments.make_walking,
    ),
    Line(
        "laser-moved",
        "all of it",
        _any,
        tool.CarriedLaser,
        "shift, m, and turn, rad, of the housing across its beam, and moment",
        of_instruments.make_moved_laser,
    ),
    Line(
        "tool-moved",
        "all of it",
        _any,
        tool.CarriedTarget,
        "shift on the flange, m, moment or time constant",
        of_instruments.make_target,
    ),
    Line(
        "fixture-moved",
        "all stations",
        _named(ONE_BODY),
        fixture.CarriedTable,
        "shift, m, and turn, rad, of the table under all stations, and its moment, s",
        of_arm.make_fixture,
    ),
    Line(
        "fixture-moved",
        "one station",
        _any,
        fixture.CarriedFixture,
        "shift, m, and turn, rad, of the fixture in its own frame, moment or duration",
        of_arm.make_fixture,
    ),
    Line(
        "psd-gain",
        "both axes alike",
        _has("gain_error_share"),
        detector.WrongGain,
        "excess of the scale, no unit",
        lambda f: detector.WrongGain(f.number, f.size("gain_error_share"), 1.0),
    ),
    Line(
        "psd-gain",
        "each axis; skew",
        _any,
        detector.StrainedFace,
        "strain along x and y and shear of the picture, no unit",
        of_instruments.make_strained,
    ),
    Line(
        "psd-nonlinearity",
        "radial",
        _shaped(Shape.RADIAL),
        detector.Pincushion,
        "distortion at the edge, no unit",
        lambda f: detector.Pincushion(f.number, f.size("edge_share"), of_instruments.half_m(f)),
    ),
    Line(
        "psd-nonlinearity",
        "cubic",
        _shaped(Shape.CUBIC),
        detector.UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: of_instruments.layer(f, ((0, 3, 0), (1, 0, 3))),
    ),
    Line(
        "psd-nonlinearity",
        "quadratic",
        _any,
        detector.UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: of_instruments.layer(f, [(a, *p) for a in (0, 1) for p in of_instruments.SQUARES]),
    ),
    Line(
        "psd-ambient-light",
        "all of it",
        _any,
        detector.StrayLight,
        "sum signal of the foreign light, V, and where it falls, m",
        of_instruments.make_stray,
    ),
    Line(
        "psd-cover-glass",
        "all of it",
        _any,
        detector.CoverGlass,
        "thickness of the window, m",
        lambda f: detector.CoverGlass(f.number, f.size("thickness_m"), INDEX),
    ),
    Line(
        "seat-moved",
        "all on one plate, or one for a while",
        lambda f: f.variant.startswith(ONE_BODY) or f.variant.endswith(FOR_A_WHILE),
        fixture.CarriedCones,
        "shift, m, and turn, rad, of the plate or the cone, moment and duration, s",
        of_arm.make_cones,
    ),
    Line(
        "seat-moved", "one cone", _any, fixture.MovedCone, "shift of the cone, m, and its moment, s", of_arm.make_cone
    ),
    Line(
        "device-scale",
        "constant",
        _has("scale_error_share"),
        tracker.TrackerScale,
        "excess of scale, no unit",
        of_instruments.make_scale,
    ),
    Line(
        "device-scale",
        "with range",
        _has("scale_change_per_m"),
        tracker.ChangingScale,
        "change of the scale, 1/m",
        lambda f: tracker.ChangingScale(per_m=f.size("scale_change_per_m")),
    ),
    Line(
        "device-scale",
        "with the square of range",
        _has("scale_change_per_m_per_m"),
        tracker.ChangingScale,
        "change of the scale, 1/m²",
        lambda f: tracker.ChangingScale(per_m2=f.size("scale_change_per_m_per_m")),
    ),
    Line(
        "device-scale",
        "with temperature",
        _any,
        tracker.ChangingScale,
        "change of the scale, 1/K, and thermometer",
        lambda f: tracker.ChangingScale(per_k=f.size("scale_share_per_k"), where=f.thermometer),
    ),
    Line(
        "device-periodic",
        "of a drum",
        _has("period_m"),
        tracker.DrumOutOfRound,
        ("distance of the drum's centre from its shaft, m, its radius, m (period over 2π), and bearing, rad"),
        of_instruments.make_drum,
    ),
    Line(
        "device-periodic",
        "of a circle",
        _any,
        tracker.CircleOffCentre,
        "error of the circle, rad, times a turn, and phase, rad",
        of_instruments.make_circle,
    ),
    Line(
        "unknown",
        "period unknown",
        _named("period unknown"),
        drive.GearRunout,
        "runout of a pinion that would do it, m, its order, and bearing, rad",
        of_arm.make_of_unknown_period,
    ),
    Line(
        "unknown",
        "fringes",
        _named("fringes"),
        detector.WavesOnFace,
        "amplitudes, m, phases, rad, waves a metre",
        of_instruments.make_waves,
    ),
    Line(
        "unknown",
        "bent face",
        _named("bent face"),
        detector.UnevenLayer,
        "error at the edge over half the face, no unit, by powers of the place",
        lambda f: of_instruments.layer(f, [(a, *p) for a in (0, 1) for p in of_instruments.CUBES]),
    ),
    Line(
        "unknown",
        "at joints, links, base and instruments",
        _any,
        found_curve.CurveAtJoints,
        ("the curve that was found, over its driver: rad or m at every sample of the session; beyond them its end"),
        of_instruments.make_curve,
    ),
)
