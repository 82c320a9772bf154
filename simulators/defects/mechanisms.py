"""Every mechanism that can be hidden, and mechanisms as plain values. A new one is a class and a line here.

As plain values: [{"mechanism": "soft-joint", "fields": {...}}, ...], as a revealed truth lists them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from simulators.defects.base import BumpedBase, DriftingBase, SoftPedestal
from simulators.defects.defect import Defect
from simulators.defects.detector import BowedScale, CoverGlass, Pincushion, SkewedElectrodes, StrayLight, WrongGain
from simulators.defects.drive import (
    CoupledWrist,
    GearRunout,
    LateClock,
    PayloadOnSoftJoint,
    SlackDrive,
    SlackUnderWeight,
    SoftJoint,
    TwoSlopeFlexspline,
    Unsettled,
    WrongRatio,
)
from simulators.defects.encoder import EccentricDisc, EncoderSlip, OvalRing, SlowFilter
from simulators.defects.fixture import BumpedFixture, MovedCone
from simulators.defects.link import BendingLink, HeatedLink, WarmArm, WornBearing
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
from simulators.defects.tool import LaserWarmUp, SaggingMount, WarmLaser
from simulators.defects.tracker import BumpedDevice, DriftingDevice, DrumOutOfRound, TrackerScale, WireScale

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


class WrittenError(ValueError):
    """The name of no mechanism, or other quantities than it has."""


def written(defects: Sequence[Defect]) -> list[dict[str, Any]]:
    """Ready for JSON."""
    return [{"mechanism": defect.KIND, "fields": dict(vars(defect))} for defect in defects]


def defects_of(listed: Sequence[Mapping[str, Any]]) -> tuple[Defect, ...]:
    """The mechanisms that were written. WrittenError with the name and the remedy."""
    return tuple(_made(one) for one in listed)


def _made(one: Mapping[str, Any]) -> Defect:
    kind: Any = next((kind for kind in MECHANISMS if one.get("mechanism") == kind.KIND), None)
    if kind is None:
        names = ", ".join(kind.KIND for kind in MECHANISMS)
        raise WrittenError(f"no mechanism {one.get('mechanism')!r}; there are {names}")
    try:
        return msgspec.convert(one.get("fields", {}), type=kind)
    except msgspec.ValidationError as error:
        raise WrittenError(f"mechanism {kind.KIND}: {error}; correct its fields") from error
