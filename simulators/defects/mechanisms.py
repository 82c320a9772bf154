"""Every mechanism, and mechanisms as plain values. A new one is a class and a line here.

`MECHANISMS` are what a concealed session draws from; `GIVEN` are those that have their numbers from a model or from a
person, and that no session draws.

As plain values: [{"mechanism": "soft-joint", "fields": {...}}, ...], as a revealed truth lists them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, cast

import msgspec

from simulators.defects.base import (
    BumpedBase,
    CarriedBase,
    DriftingBase,
    PedestalUnderWeights,
    SoftPedestal,
    UnevenPedestal,
)
from simulators.defects.defect import Defect
from simulators.defects.detector import (
    BowedScale,
    CoverGlass,
    Pincushion,
    SkewedElectrodes,
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
from simulators.defects.fixture import BumpedFixture, CarriedFixture, MovedCone
from simulators.defects.found_curve import CurveAtBase, CurveAtJoints, CurveAtLink, CurveInReading
from simulators.defects.link import BeamUnderWeights, BendingLink, FlatLink, HeatedLink, WarmArm, WarmingUp, WornBearing
from simulators.defects.outside import (
    BentRay,
    CableBundle,
    DragChain,
    FanOnBracket,
    Fringes,
    GearBeat,
    NarrowBump,
    SaturatedProduct,
    StickingPad,
    UnevenSpring,
)
from simulators.defects.tool import (
    CarriedLaser,
    CarriedTarget,
    ElasticMount,
    LaserWarmUp,
    ReseatedLaser,
    ReseatedTarget,
    SaggingMount,
    WarmLaser,
)
from simulators.defects.tracker import (
    BumpedDevice,
    CarriedDevice,
    ChangingScale,
    CircleOffCentre,
    DriftingDevice,
    DrumOutOfRound,
    TrackerScale,
    WireScale,
)

MECHANISMS: tuple[type[Defect], ...] = (
    EccentricDisc,
    OvalRing,
    EncoderSlip,
    GearRunout,
    WrongRatio,
    CoupledWrist,
    SlackDrive,
    SlackUnderWeight,
    SoftJoint,
    TwoSlopeFlexspline,
    PayloadOnSoftJoint,
    SlowFilter,
    Unsettled,
    LateClock,
    WornBearing,
    BendingLink,
    HeatedLink,
    WarmArm,
    DriftingBase,
    BumpedBase,
    SoftPedestal,
    SaggingMount,
    LaserWarmUp,
    WarmLaser,
    BumpedFixture,
    Pincushion,
    BowedScale,
    WrongGain,
    SkewedElectrodes,
    StrayLight,
    CoverGlass,
    TrackerScale,
    DriftingDevice,
    BumpedDevice,
    WireScale,
    DrumOutOfRound,
    MovedCone,
    ReseatedTarget,
    ReseatedLaser,
    SaturatedProduct,
    NarrowBump,
    CableBundle,
    StickingPad,
    GearBeat,
    UnevenSpring,
    FanOnBracket,
    Fringes,
    BentRay,
    DragChain,
)
GIVEN: tuple[type[Defect], ...] = (
    StaleReading,
    HardeningSpring,
    SpringUnderWeights,
    PressedJoint,
    FlatLink,
    BeamUnderWeights,
    WarmingUp,
    UnevenPedestal,
    PedestalUnderWeights,
    CarriedBase,
    ElasticMount,
    CarriedLaser,
    CarriedTarget,
    CarriedFixture,
    StrainedFace,
    UnevenLayer,
    WavesOnFace,
    CarriedDevice,
    ChangingScale,
    CircleOffCentre,
    CurveAtJoints,
    CurveAtLink,
    CurveAtBase,
    CurveInReading,
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
