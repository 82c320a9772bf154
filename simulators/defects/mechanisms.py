"""Every mechanism, and mechanisms as plain values. A new one is a class and a line here.

`MECHANISMS` are what a concealed session draws from. `RAISED` were met on real robots, are drawn only where they are
asked for by name, and have no part in the moving world of the emulators. `GIVEN` are those that have their numbers from
a model, from a person, or from the concealed proof of torques, and that no session of poses draws.

As plain values: [{"mechanism": "soft-joint", "fields": {...}}, ...], as a revealed truth lists them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, cast

import msgspec

from simulators.defects import (
    base,
    detector,
    drive,
    encoder,
    fixture,
    found_curve,
    link,
    outside,
    outside_torque,
    tool,
    torque,
    tracker,
)
from simulators.defects.defect import Defect

MECHANISMS: tuple[type[Defect], ...] = (
    encoder.EccentricDisc,
    encoder.OvalRing,
    encoder.EncoderSlip,
    drive.GearRunout,
    drive.WrongRatio,
    drive.CoupledWrist,
    drive.SlackDrive,
    drive.SlackUnderWeight,
    drive.SoftJoint,
    drive.TwoSlopeFlexspline,
    drive.PayloadOnSoftJoint,
    encoder.SlowFilter,
    drive.Unsettled,
    drive.LateClock,
    link.WornBearing,
    link.BendingLink,
    link.HeatedLink,
    link.WarmArm,
    base.DriftingBase,
    base.BumpedBase,
    base.SoftPedestal,
    tool.SaggingMount,
    tool.LaserWarmUp,
    tool.WarmLaser,
    fixture.BumpedFixture,
    detector.Pincushion,
    detector.BowedScale,
    detector.WrongGain,
    detector.SkewedElectrodes,
    detector.StrayLight,
    detector.CoverGlass,
    tracker.TrackerScale,
    tracker.DriftingDevice,
    tracker.BumpedDevice,
    tracker.WireScale,
    tracker.DrumOutOfRound,
    fixture.MovedCone,
    tool.ReseatedTarget,
    tool.ReseatedLaser,
    outside.SaturatedProduct,
    outside.NarrowBump,
    outside.CableBundle,
    outside.StickingPad,
    outside.GearBeat,
    outside.UnevenSpring,
    outside.FanOnBracket,
    outside.Fringes,
    outside.BentRay,
    outside.DragChain,
)
RAISED: tuple[type[Defect], ...] = (
    detector.SpottedFace,
    fixture.KnockedTable,
    fixture.KnockedPlate,
    drive.HystereticSpring,
    drive.OneSidedSpring,
    drive.WrongLoadCentre,
    link.LaggingLink,
    base.BrieflyShiftedBase,
    tool.BrieflyShiftedLaser,
)
GIVEN: tuple[type[Defect], ...] = (
    encoder.StaleReading,
    drive.HardeningSpring,
    drive.SpringUnderWeights,
    drive.PressedJoint,
    link.FlatLink,
    link.BeamUnderWeights,
    link.WarmingUp,
    base.UnevenPedestal,
    base.PedestalUnderWeights,
    base.CarriedBase,
    tool.ElasticMount,
    tool.CarriedLaser,
    tool.CarriedTarget,
    fixture.CarriedFixture,
    fixture.CarriedTable,
    fixture.CarriedCones,
    detector.StrainedFace,
    detector.UnevenLayer,
    detector.WavesOnFace,
    tracker.CarriedDevice,
    tracker.ChangingScale,
    tracker.CircleOffCentre,
    found_curve.CurveAtJoints,
    found_curve.CurveAtLink,
    found_curve.CurveAtBase,
    found_curve.CurveInReading,
    torque.Coulomb,
    torque.Viscous,
    torque.Stribeck,
    torque.LoadFriction,
    torque.JointSpring,
    torque.GearRipple,
    torque.HeavyRotor,
    torque.UnstatedPayload,
    torque.LeaningGravity,
    torque.WrongTorqueConstant,
    torque.TorqueOffset,
    torque.LateTorque,
    outside_torque.BentSeal,
    outside_torque.ShortHose,
    outside_torque.WornOutputWheel,
)


class WrittenError(ValueError):
    """The name of no mechanism, or other quantities than it has."""


def written(defects: Sequence[Defect]) -> list[dict[str, Any]]:
    """Ready for JSON."""
    return [{"mechanism": defect.KIND, "fields": asdict(cast("Any", defect))} for defect in defects]


def defects_of(listed: Sequence[Mapping[str, Any]]) -> tuple[Defect, ...]:
    """The mechanisms that were written. WrittenError with the name and the remedy."""
    return tuple(_made(one) for one in listed)


def _made(one: Mapping[str, Any]) -> Defect:
    kind: Any = next((kind for kind in (*MECHANISMS, *GIVEN) if one.get("mechanism") == kind.KIND), None)
    if kind is None:
        names = ", ".join(kind.KIND for kind in (*MECHANISMS, *GIVEN))
        raise WrittenError(f"no mechanism {one.get('mechanism')!r}; there are {names}")
    try:
        return msgspec.convert(one.get("fields", {}), type=kind)
    except msgspec.ValidationError as error:
        raise WrittenError(f"mechanism {kind.KIND}: {error}; correct its fields") from error
