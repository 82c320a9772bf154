"""Every mechanism that can be hidden. A new one is one file and one line here."""

from simulators.defects.base import DriftingBase
from simulators.defects.bumped_base import BumpedBase
from simulators.defects.bumped_device import BumpedDevice
from simulators.defects.coupled_wrist import CoupledWrist
from simulators.defects.defect import Defect
from simulators.defects.detector import Pincushion
from simulators.defects.drifting_device import DriftingDevice
from simulators.defects.drive import SoftJoint
from simulators.defects.encoder import EccentricDisc
from simulators.defects.encoder_slip import EncoderSlip
from simulators.defects.fixture import BumpedFixture
from simulators.defects.gear_runout import GearRunout
from simulators.defects.heated_link import HeatedLink
from simulators.defects.laser_warm_up import LaserWarmUp
from simulators.defects.late_clock import LateClock
from simulators.defects.link import BendingLink
from simulators.defects.moved_cone import MovedCone
from simulators.defects.outside import SaturatedProduct
from simulators.defects.outside_beat import GearBeat
from simulators.defects.outside_bump import NarrowBump
from simulators.defects.outside_cable import CableBundle
from simulators.defects.outside_drag_chain import DragChain
from simulators.defects.outside_fan import FanOnBracket
from simulators.defects.outside_fringes import Fringes
from simulators.defects.outside_refraction import BentRay
from simulators.defects.outside_sticking import StickingPad
from simulators.defects.outside_uneven_spring import UnevenSpring
from simulators.defects.oval_ring import OvalRing
from simulators.defects.payload_on_soft_joint import PayloadOnSoftJoint
from simulators.defects.psd_bowed import BowedScale
from simulators.defects.psd_gain import WrongGain
from simulators.defects.psd_glass import CoverGlass
from simulators.defects.psd_skewed import SkewedElectrodes
from simulators.defects.psd_stray_light import StrayLight
from simulators.defects.slack_drive import SlackDrive
from simulators.defects.slack_under_weight import SlackUnderWeight
from simulators.defects.slow_filter import SlowFilter
from simulators.defects.soft_pedestal import SoftPedestal
from simulators.defects.tool import SaggingMount
from simulators.defects.tracker import DrumOutOfRound
from simulators.defects.tracker_scale import TrackerScale
from simulators.defects.two_slope_flexspline import TwoSlopeFlexspline
from simulators.defects.unsettled import Unsettled
from simulators.defects.warm_arm import WarmArm
from simulators.defects.warm_laser import WarmLaser
from simulators.defects.wire_scale import WireScale
from simulators.defects.worn_bearing import WornBearing
from simulators.defects.wrong_ratio import WrongRatio

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
