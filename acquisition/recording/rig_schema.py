"""The rig file as frozen records: the rig as believed, how its devices are reached, how it may move.

Names, units and optional keys are those of the session-folder format, version 1 (docs/formats.md). A key that is
not declared here is refused. Vectors are plain tuples: metres, or radians of a rotation vector.
"""

import enum
from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta, Struct, field

Vector = tuple[float, float, float]
Positive = Annotated[float, Meta(gt=0.0)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Identity = Annotated[int, Meta(ge=1)]
Word = Annotated[str, Meta(min_length=1)]
ZERO: Vector = (0.0, 0.0, 0.0)


class ArmModel(enum.Enum):
    """How the fixed part of a link is written."""

    DH = "dh"  # standard Denavit-Hartenberg
    MDH = "mdh"  # modified, after Craig
    LOCAL_POE = "local-poe"  # local product of exponentials: T[i-1,i](0)


class Pose(Struct, frozen=True, forbid_unknown_fields=True):
    """A frame in another one: its origin (m) and its rotation vector (rad)."""

    origin_m: Vector = ZERO
    rotation_rad: Vector = ZERO


class Joint(Struct, frozen=True, forbid_unknown_fields=True):
    """One axis and the link after it. Either a, alpha, d (and theta offset), or origin and rotation, by `arm.model`."""

    lower_rad: float
    upper_rad: float
    a_m: float | None = None
    alpha_rad: float | None = None
    d_m: float | None = None
    theta_offset_rad: float | None = None  # None in a D-H arm counts as 0: parse_rig fills it in
    origin_m: Vector | None = None
    rotation_rad: Vector | None = None
    gear_ratio: Positive | None = None
    encoder_counts: Identity | None = None
    mass_kg: NotNegative | None = None
    com_m: Vector | None = None


class Arm(Struct, frozen=True, forbid_unknown_fields=True):
    """The kinematic chain, base to flange."""

    model: ArmModel
    joints: Annotated[tuple[Joint, ...], Meta(min_length=1)] = field(name="joint")
    gravity_m_s2: Vector = (0.0, 0.0, -9.81)  # an arm that stands on its feet
    flange: Pose = Pose()


class Tool(Struct, frozen=True, forbid_unknown_fields=True):
    """What hangs at the flange, in the flange frame. `laser_direction` has length 1 after reading."""

    mass_kg: NotNegative | None = None
    com_m: Vector | None = None
    point_m: Vector | None = None
    laser_origin_m: Vector | None = None
    laser_direction: Vector | None = None


class Fixture(Struct, frozen=True, forbid_unknown_fields=True):
    """Two square detectors that see each other."""

    half_size_m: Positive
    psd2_in_psd1: Pose


class Placement(Struct, frozen=True, forbid_unknown_fields=True):
    """One place where the fixture stood."""

    id: Identity
    psd1_in_base: Pose


class KnownDistance(Struct, frozen=True, forbid_unknown_fields=True):
    """A measured distance between the PSD 1 centres of two placements: the source of scale."""

    from_placement: Identity = field(name="from")
    to_placement: Identity = field(name="to")
    length_m: Positive
    sigma_m: Positive


class Bar(Struct, frozen=True, forbid_unknown_fields=True):
    """A calibrated length artefact."""

    id: Identity
    length_m: Positive


class Noise(Struct, frozen=True, forbid_unknown_fields=True):
    """One sigma as believed: a start value only. None: nothing is believed."""

    psd_m: Positive | None = None
    position_m: Positive | None = None
    wire_m: Positive | None = None
    seat_m: Positive | None = None
    joint_rad: Positive | None = None


class Tolerance(Struct, frozen=True, forbid_unknown_fields=True):
    """One sigma of the drawing: priors of the fit. What may be None is, without it, taken as `docs/formats.md` says."""

    length_m: Positive
    angle_rad: Positive
    gain: Positive | None = None  # of both detectors' scales, about 1
    psd2_m: Positive | None = None  # of PSD 2 in PSD 1, with psd2_rad
    psd2_rad: Positive | None = None
    device_m: Positive | None = None  # of [device] in the base, with device_rad
    device_rad: Positive | None = None


class PsdDriver(enum.Enum):
    """Detector electronics that can be read."""

    PSD_DAQ = "psd-daq"


class EncoderDriver(enum.Enum):
    """Encoder profiles that can be read."""

    CIA406 = "cia406"


class RobotDriver(enum.Enum):
    """Controllers that can be driven."""

    UR_RTDE = "ur-rtde"


class PsdDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The detectors' serial line, by path or by USB serial number."""

    driver: PsdDriver
    port: Word | None = None
    serial_number: Word | None = None
    rate_hz: Positive = 1000.0  # where the 2 um of a PSD are stated


class EncodersDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The encoders' CAN bus; `interface` and `channel` are python-can's words; one node per joint, in order."""

    driver: EncoderDriver
    interface: Word
    channel: Word
    nodes: tuple[Annotated[int, Meta(ge=1, le=127)], ...]  # CiA 301, 7.2: node-IDs 1 to 127
    bitrate: Identity = 1_000_000
    sync_hz: Positive = 200.0


class RobotDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The controller's address and the rate of its stream."""

    driver: RobotDriver
    host: Word
    rate_hz: Positive = 500.0  # e-Series control cycle


class Devices(Struct, frozen=True, forbid_unknown_fields=True):
    """How each instrument is reached; one that is not named is not there."""

    psd: PsdDevice | None = None
    encoders: EncodersDevice | None = None
    robot: RobotDevice | None = None


class Motion(Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of every motion. The defaults are slow: nobody has said yet what this cell allows."""

    speed_rad_s: Positive = 0.5
    acceleration_rad_s2: Positive = 1.0
    step_limit_rad: Positive = 0.1  # largest joint step of the centring servo
    home_rad: tuple[float, ...] | None = None  # joint readings clear of everything, where a session starts


# Keys of [emulation]; the section belongs to the emulators, which read it themselves from the same file.
EMULATION_KEYS = (
    "seed",
    "time_scale",
    "length_sigma_m",
    "angle_sigma_rad",
    "joint_zero_max_rad",
    "placement_origin_sigma_m",
    "placement_rotation_sigma_rad",
    "laser_origin_sigma_m",
    "laser_direction_sigma_rad",
    "joint_repeatability_rad",
    "psd_noise_m",
    "laser_power_w",
)


class Rig(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole rig file. Sections that are absent are None, empty, or a record of defaults."""

    schema: Literal[1]
    name: Word
    arm: Arm
    tool: Tool = Tool()
    fixture: Fixture | None = None
    placement_list: tuple[Placement, ...] = field(name="placement", default=())
    device: Pose | None = None  # measuring device of position and wire observations, in the base frame
    known_distances: tuple[KnownDistance, ...] = field(name="known_distance", default=())
    bar_list: tuple[Bar, ...] = field(name="bar", default=())
    noise: Noise = Noise()
    tolerance: Tolerance | None = None
    devices: Devices = Devices()
    motion: Motion = Motion()
    emulation: Mapping[str, float] | None = None

    @property
    def n_joints(self) -> int:
        return len(self.arm.joints)

    @property
    def placements(self) -> Mapping[int, Placement]:
        """By id, in the order of the file."""
        return {placement.id: placement for placement in self.placement_list}

    @property
    def bars(self) -> Mapping[int, Bar]:
        """By id, in the order of the file."""
        return {bar.id: bar for bar in self.bar_list}
