"""From an effect of a model to a mechanism of the simulators: one entry for each form of an effect, in `TABLE`.

An effect is a regressor, a mechanism is what is physically wrong. What crosses over is a quantity with a unit and a
meaning of its own: a stiffness in rad/Nm, a distance between two centres in m, an expansion in 1/K. The simulators work
out by themselves what that does; tests/calibeam/simulation holds one against the other over the whole catalogue.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from operator import attrgetter
from typing import Any

from calibeam.simulation import of_arm, of_instruments
from calibeam.simulation.counterpart import JOINTS, NUMBER, THERMOMETER, Counterpart, Form, times
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
    """An effect that no entry of the table takes."""


def mechanism_of(found: FoundEffect) -> Sited:
    """NoMechanismError where no entry takes it, or its drivers are none that the simulators follow."""
    counterpart = counterpart_of(found)
    try:
        return Sited(counterpart.of(found), _site(found))
    except KeyError as missing:
        raise NoMechanismError(f"its driver {missing.args[0]} is unknown to the simulation") from missing


def counterpart_of(found: FoundEffect) -> Counterpart:
    """That of the first form that takes it. NoMechanismError where none does."""
    for form, counterpart in TABLE.items():
        if form.takes(found):
            return counterpart
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


WEIGHTS = "masses corrected; unknown masses"
UNSTATED = ("masses corrected", "unknown masses")
EACH_WAY = "each way its own"
DIRECTION = "*direction"
WARMTH = "temp_*"
AT_THE_EDGE = "error at the edge over half the face, no unit, by powers of the place"
TABLE: Mapping[Form, Counterpart] = {
    # --- joints
    Form("encoder-eccentricity", "once a turn"): Counterpart(
        encoder.EccentricDisc,
        "distance of the disc's centre from its shaft, m (amplitude times radius), and its bearing, rad",
        eccentricity_m=times(encoder.RADIUS_M, "amplitude_rad"),
        bearing_rad=times(-1.0, "phase_rad"),
    ),
    Form("encoder-harmonic", "two to four times a turn"): Counterpart(
        encoder.OvalRing,
        "largest radius of the ring over its mean radius less 1 (order times amplitude), and its bearing, rad",
        of_arm.make_ring,
    ),
    Form("gear-transmission-error", "at the mesh"): Counterpart(
        drive.GearRunout,
        "runout of the pinion, m (amplitude times the radius of the wheel), ratio, and bearing, rad",
        runout_m=times(of_arm.WHEEL_M, "amplitude_rad"),
        ratio="order_per_turn",
        second=0.0,
        bearing_rad=times(-1.0, "phase_rad"),
    ),
    Form("gear-ratio-error"): Counterpart(
        drive.WrongRatio, "excess of the ratio, no unit", excess="scale_error_rad_per_rad"
    ),
    Form("joint-coupling"): Counterpart(
        drive.CoupledWrist,
        "share of the other joint's turn, no unit",
        other=attrgetter("other_joint"),
        share="coupling_rad_per_rad",
    ),
    Form("joint-compliance", "hand force", ("hand force",)): Counterpart(
        drive.PressedJoint,
        "compliance of the joint, rad/Nm, and force of the hand, N, in the flange's axes",
        of_arm.make_pressed,
    ),
    Form("joint-compliance", WEIGHTS, UNSTATED): Counterpart(
        drive.SpringUnderWeights,
        "masses and first moments times compliance, kg rad/Nm and kg m rad/Nm, that load it as was found",
        lambda f: drive.SpringUnderWeights(f.number, *of_arm.spring_weights(f)),
    ),
    Form("joint-compliance", "with a knee", ("knee",)): Counterpart(
        drive.TwoSlopeFlexspline,
        "compliance below and above the knee, rad/Nm, and the knee, Nm",
        of_arm.make_two_slopes,
    ),
    Form("joint-compliance", "stiffening", shape=Shape.CUBIC): Counterpart(
        drive.HardeningSpring,
        "compliance at rest, rad/Nm, and its cubic part, rad/Nm³",
        compliance_rad_nm="compliance_at_rest_rad_nm",
        hardening_rad_nm3=lambda f: f.size("compliance_change_rad_nm") / f.largest_nm**2,
    ),
    Form("joint-compliance", "linear"): Counterpart(drive.SoftJoint, "compliance, rad/Nm"),
    Form("payload-compliance"): Counterpart(
        drive.PayloadOnSoftJoint,
        "compliance, rad/Nm, and where it was found the payload's centre of mass, m",
        of_arm.make_payload,
    ),
    Form("backlash", "by approach", driver="approach*"): Counterpart(drive.SlackDrive, "play between the flanks, rad"),
    Form("backlash", "by weight"): Counterpart(
        drive.SlackUnderWeight,
        "play between the flanks, rad, and friction, Nm (1.4 times the effect's turn-over)",
        friction_nm=of_arm.friction_nm,
        within=0.15,
        differs="friction lets the joint go over from flank to flank along a straight line, the effect along a "
        "smooth curve; beyond the turn-over they agree",
    ),
    Form("reading-lag", "of the last move", driver="last_move*"): Counterpart(
        encoder.SlowFilter,
        "share of the last move that the filter has not passed on, no unit (the effect's with the other sign)",
        missing=times(-1.0, "lag_share"),
    ),
    Form("reading-lag", "of the command"): Counterpart(
        encoder.StaleReading, "share of the following error, no unit", missing="lag_share"
    ),
    Form("not-settled"): Counterpart(
        drive.Unsettled, "share of the last move that is left, no unit", left="left_share"
    ),
    Form("latency"): Counterpart(drive.LateClock, "delay, s", late_s="delay_s"),
    Form("encoder-slip"): Counterpart(
        encoder.EncoderSlip,
        "slip of the reading, rad (the effect's with the other sign), and its moment, s",
        slip_rad=times(-1.0, "slip_rad"),
    ),
    # --- links and base
    Form("axis-wobble"): Counterpart(
        link.WornBearing, "lean of the axis, rad, lobes a turn, bearing, rad", of_arm.make_wobble
    ),
    Form("link-bending", WEIGHTS, UNSTATED): Counterpart(
        link.BeamUnderWeights,
        "masses and first moments times L/(EI), kg rad/Nm and kg m rad/Nm, that bend it as was found",
        lambda f: link.BeamUnderWeights(f.number, *of_arm.beam_weights(f)),
    ),
    Form("link-bending", EACH_WAY, (EACH_WAY,)): Counterpart(
        link.FlatLink, "1/(EI) about two axes across the link, 1/(Nm²)", of_arm.make_flat
    ),
    Form("link-bending", "as stiff all round"): Counterpart(
        link.BendingLink,
        "1/(EI), 1/(Nm²) (compliance over length)",
        bending_per_nm2=lambda f: f.size("compliance_rad_nm") / of_arm.length_m(f),
        light=True,
    ),
    Form("link-thermal-growth", "whole arm, by temperature", ("whole arm",), WARMTH): Counterpart(
        link.WarmArm, "expansion, 1/K, and thermometer", where=THERMOMETER, first=1
    ),
    Form("link-thermal-growth", "whole arm, over time", ("whole arm",)): Counterpart(
        link.WarmingUp,
        "growth in the end, no unit, and time constant, s",
        first=1,
        last=JOINTS,
        growth="growth_share",
    ),
    Form("link-thermal-growth", "one link, behind its thermometer", (BEHIND,)): Counterpart(
        link.LaggingLink,
        "expansion, 1/K, thermometer, and time constant of the link behind it, s",
        where=THERMOMETER,
        time_constant_s="lag_s",
    ),
    Form("link-thermal-growth", "one link, by temperature", driver=WARMTH): Counterpart(
        link.HeatedLink, "expansion, 1/K, and thermometer", where=THERMOMETER
    ),
    Form("link-thermal-growth", "one link, over time"): Counterpart(
        link.WarmingUp,
        "growth in the end, no unit, and time constant, s",
        first=NUMBER,
        last=NUMBER,
        growth="growth_share",
    ),
    Form("base-compliance", WEIGHTS, UNSTATED): Counterpart(
        base.PedestalUnderWeights,
        "masses and first moments times compliance, kg rad/Nm and kg m rad/Nm, that tilt it as was found",
        lambda f: base.PedestalUnderWeights(*of_arm.pedestal_weights(f)),
    ),
    Form("base-compliance", EACH_WAY, (EACH_WAY,)): Counterpart(
        base.UnevenPedestal,
        "compliance about x and y, rad/Nm",
        about_x_rad_nm="compliance_x_rad_nm",
        about_y_rad_nm="compliance_y_rad_nm",
    ),
    Form("base-compliance", "as stiff all round"): Counterpart(base.SoftPedestal, "compliance, rad/Nm"),
    Form("base-moved"): Counterpart(
        base.CarriedBase,
        "shift, m, and turn, rad, of the foot (the effect's with the other sign: it moves what stands "
        "around), moment, duration or thermometer",
        of_arm.make_base,
    ),
    # --- tool, laser and fixture
    Form("device-drift"): Counterpart(
        tracker.CarriedDevice,
        "shift, m, and turn, rad, of the device in its own frame, moment, duration or thermometer",
        of_arm.make_device,
    ),
    Form("tool-sag", "bracket", ("bracket, overhang*",)): Counterpart(
        tool.SaggingMount, "lean when the overhang is level, rad", of_instruments.make_bracket
    ),
    Form("tool-sag", "towards gravity", ("towards gravity",)): Counterpart(
        tool.SaggingMount, "lean when the beam is level, rad, about the laser", of_instruments.make_leaning
    ),
    Form("tool-sag", "mount of any shape", ("mount of any shape",)): Counterpart(
        tool.ElasticMount, "turn for one weight along x, y, z of the flange, rad", of_instruments.make_mount
    ),
    Form("tool-sag", "hanging", ("hanging",)): Counterpart(
        tool.ElasticMount, "shift for one weight, m", of_instruments.make_hanging
    ),
    Form("tool-sag", "bracket of any shape"): Counterpart(
        tool.ElasticMount, "shift for one weight along x, y, z of the flange, m", of_instruments.make_spring_mount
    ),
    Form("laser-warm-up", "of the direction", port=DIRECTION): Counterpart(
        tool.LaserWarmUp, "turn in the end, rad, its axis, and time constant, s", of_instruments.make_pointing
    ),
    Form("laser-warm-up", "of the origin"): Counterpart(
        tool.CarriedLaser, "shift in the end, m, time constant, s", of_instruments.make_walking
    ),
    Form("laser-thermal-drift", "of the direction", port=DIRECTION): Counterpart(
        tool.WarmLaser, "turn, rad/K, its axis, and thermometer", of_instruments.make_pointing
    ),
    Form("laser-thermal-drift", "of the origin"): Counterpart(
        tool.CarriedLaser, "shift, m/K, and thermometer", of_instruments.make_walking
    ),
    Form("laser-moved"): Counterpart(
        tool.CarriedLaser,
        "shift, m, and turn, rad, of the housing across its beam, and moment",
        of_instruments.make_moved_laser,
    ),
    Form("tool-moved"): Counterpart(
        tool.CarriedTarget, "shift on the flange, m, moment or time constant", of_instruments.make_target
    ),
    Form("fixture-moved", "all stations", (ONE_BODY,)): Counterpart(
        fixture.CarriedTable,
        "shift, m, and turn, rad, of the table under all stations, and its moment, s",
        of_arm.make_fixture,
    ),
    Form("fixture-moved", "one station"): Counterpart(
        fixture.CarriedFixture,
        "shift, m, and turn, rad, of the fixture in its own frame, moment or duration",
        of_arm.make_fixture,
    ),
    # --- detectors, cones and devices
    Form("psd-gain", "both axes alike", size="gain_error_share"): Counterpart(
        detector.WrongGain, "excess of the scale, no unit", excess="gain_error_share", x_share=1.0
    ),
    Form("psd-gain", "each axis; skew"): Counterpart(
        detector.StrainedFace,
        "strain along x and y and shear of the picture, no unit",
        of_instruments.make_strained,
    ),
    Form("psd-nonlinearity", "radial", shape=Shape.RADIAL): Counterpart(
        detector.Pincushion, "distortion at the edge, no unit", distortion="edge_share"
    ),
    Form("psd-nonlinearity", "cubic", shape=Shape.CUBIC): Counterpart(
        detector.UnevenLayer, AT_THE_EDGE, powers=of_instruments.powers((0, 3, 0), (1, 0, 3))
    ),
    Form("psd-nonlinearity", "quadratic"): Counterpart(
        detector.UnevenLayer, AT_THE_EDGE, powers=of_instruments.powers(*of_instruments.SQUARES)
    ),
    Form("psd-ambient-light"): Counterpart(
        detector.StrayLight, "sum signal of the foreign light, V, and where it falls, m", of_instruments.make_stray
    ),
    Form("psd-cover-glass"): Counterpart(detector.CoverGlass, "thickness of the window, m", index=INDEX),
    Form("seat-moved", "all on one plate, or one for a while", (f"{ONE_BODY}*", f"*{FOR_A_WHILE}")): Counterpart(
        fixture.CarriedCones,
        "shift, m, and turn, rad, of the plate or the cone, moment and duration, s",
        of_arm.make_cones,
    ),
    Form("seat-moved", "one cone"): Counterpart(
        fixture.MovedCone, "shift of the cone, m, and its moment, s", of_arm.make_cone
    ),
    Form("device-scale", "constant", size="scale_error_share"): Counterpart(
        tracker.TrackerScale, "excess of scale, no unit", of_instruments.make_scale
    ),
    Form("device-scale", "with range", size="scale_change_per_m"): Counterpart(
        tracker.ChangingScale, "change of the scale, 1/m", per_m="scale_change_per_m"
    ),
    Form("device-scale", "with the square of range", size="scale_change_per_m_per_m"): Counterpart(
        tracker.ChangingScale, "change of the scale, 1/m²", per_m2="scale_change_per_m_per_m"
    ),
    Form("device-scale", "with temperature"): Counterpart(
        tracker.ChangingScale,
        "change of the scale, 1/K, and thermometer",
        per_k="scale_share_per_k",
        where=THERMOMETER,
    ),
    Form("device-periodic", "of a drum", size="period_m"): Counterpart(
        tracker.DrumOutOfRound,
        "distance of the drum's centre from its shaft, m, its radius, m (period over 2π), and bearing, rad",
        of_instruments.make_drum,
    ),
    Form("device-periodic", "of a circle"): Counterpart(
        tracker.CircleOffCentre,
        "error of the circle, rad, times a turn, and phase, rad",
        circle=lambda f: "azimuth" if f.variant == "azimuth" else "elevation",
        order=lambda f: f.term.order or 1,
    ),
    # --- what has no name
    Form("unknown", "period unknown", ("period unknown",)): Counterpart(
        drive.GearRunout,
        "runout of a pinion that would do it, m, its order, and bearing, rad",
        of_arm.make_of_unknown_period,
    ),
    Form("unknown", "fringes", ("fringes",)): Counterpart(
        detector.WavesOnFace, "amplitudes, m, phases, rad, waves a metre", of_instruments.make_waves
    ),
    Form("unknown", "bent face", ("bent face",)): Counterpart(
        detector.UnevenLayer, AT_THE_EDGE, powers=of_instruments.powers(*of_instruments.CUBES)
    ),
    Form("unknown", "at joints, links, base and instruments"): Counterpart(
        found_curve.CurveAtJoints,
        "the curve that was found, over its driver: rad or m at every sample of the session; beyond them its end",
        of_instruments.make_curve,
    ),
}
