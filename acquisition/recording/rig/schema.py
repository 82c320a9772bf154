"""The rig file as frozen records: the rig as assumed, how its devices are reached, how it may move.

Names, units and optional keys are those of the session-folder format, version 1 (docs/formats.md). A key that is
not declared here is refused. Vectors are plain tuples: metres, or radians of a rotation vector.
"""

import enum
from collections.abc import Mapping
from datetime import date
from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from acquisition.recording.files.bounds import (
    JOINTS,
    ZERO,
    Acceleration,
    ArmMetres,
    ArmVector,
    Count,
    Direction,
    Few,
    FilePath,
    GearRatio,
    Gravity,
    Hertz,
    Identity,
    Kilograms,
    Markers,
    MetresOrNone,
    Name,
    Number,
    PartSize,
    PartSizeOrNone,
    PerJoint,
    Pixels,
    Positive,
    Radians,
    RadiansAbove,
    RoomSize,
    RoomVector,
    Rotation,
    Seconds,
    SecondsAbove,
    Share,
    SigmaMetres,
    SigmaRadians,
    Speed,
    Vector,
)
from acquisition.recording.rig.devices import Devices

Inertia = tuple[Number, Number, Number, Number, Number, Number]


class ArmModel(enum.Enum):
    """How the fixed part of a link is written."""

    DH = "dh"  # standard Denavit-Hartenberg
    MDH = "mdh"  # modified, after Craig
    LOCAL_POE = "local-poe"  # local product of exponentials: T[i-1,i](0)


class Pose(Struct, frozen=True, forbid_unknown_fields=True):
    """A frame in another one: its origin (m) and its rotation vector (rad)."""

    origin_m: RoomVector = ZERO
    rotation_rad: Rotation = ZERO


class Make(enum.Enum):
    """Whose controller moves the arm: what a model can be exported to, and what its numbers are called there."""

    ABB = "abb"
    FANUC = "fanuc"
    FRANKA = "franka"
    KUKA = "kuka"
    MOTOMAN = "motoman"
    STAUBLI = "staubli"
    UR = "ur"
    OTHER = "other"


class EncoderSide(enum.Enum):
    """On which side of the gear a second encoder sits."""

    LINK = "link"
    MOTOR = "motor"


class Follows(Struct, frozen=True, forbid_unknown_fields=True):
    """A joint whose reported angle is not counted from the link in front of it: see `Joint.follows`."""

    joint: Identity  # another joint, nearer to the base, from 1
    by: Number = 1.0  # 1 or -1


class Joint(Struct, frozen=True, forbid_unknown_fields=True):
    """One axis and the link after it. Either a, alpha, d (and theta offset), or origin and rotation, by `arm.model`."""

    lower_rad: Radians
    upper_rad: Radians
    a_m: ArmMetres | None = None
    alpha_rad: Radians | None = None
    d_m: ArmMetres | None = None
    theta_offset_rad: Radians | None = None  # None in a D-H arm counts as 0: parse_rig fills it in
    origin_m: ArmVector | None = None
    rotation_rad: Rotation | None = None
    gear_ratio: GearRatio | None = None
    rotor_inertia_kg_m2: Positive | None = None  # of rotor and gear, at the joint: times the square of the ratio
    torque_per_ampere: Positive | None = None  # Nm at the joint, ratio of the gear included
    encoder_counts: Identity | None = None
    encoder_side: EncoderSide | None = None  # of the second encoder; None: not known
    encoder_zero_rad: Radians | None = None  # reading of the second encoder where this joint reads 0; None: not known
    mass_kg: Kilograms | None = None
    com_m: ArmVector | None = None
    inertia_kg_m2: Inertia | None = None  # xx, yy, zz, xy, xz, yz about the centre of mass, in the axes of the link
    sign: Literal[-1, 1] = 1  # -1: the controller counts against the nominal axis; taken into the numbers (senses.py)
    follows: Follows | None = None  # angle from the link in front = reported angle + by * reported angle of that joint


class Arm(Struct, frozen=True, forbid_unknown_fields=True):
    """The kinematic chain, base to flange."""

    model: ArmModel
    joints: Annotated[tuple[Joint, ...], Meta(min_length=1, max_length=JOINTS)] = field(name="joint")
    gravity_m_s2: Gravity = (0.0, 0.0, -9.81)  # an arm that stands on its feet
    flange: Pose = Pose()
    base: Pose = Pose()  # of a D-H table: fixed transform in front of the first joint
    serial_number: Name | None = None  # of the maker's plate: distinguishes two arms of one kind
    make: Make | None = None  # None: not stated


NO_ARM = Arm(ArmModel.DH, ())  # of a rig that only logs encoders


class Tool(Struct, frozen=True, forbid_unknown_fields=True):
    """What hangs at the flange, in the flange frame. `laser_direction` has length 1 after reading."""

    mass_kg: Kilograms | None = None
    com_m: ArmVector | None = None
    point_m: ArmVector | None = None
    laser_origin_m: ArmVector | None = None
    laser_direction: Direction | None = None
    probe_diameter_m: PartSizeOrNone | None = None  # of the ball whose centre is `point_m`


class FlangeTarget(Struct, frozen=True, forbid_unknown_fields=True):
    """One of several targets (reflectors) on the flange: where it sits in the flange frame.

    `point_sigma_m`: how well this is known, a coordinate, where it was measured; None: as a bracket is mounted by hand.
    """

    id: Identity
    point_m: ArmVector
    point_sigma_m: SigmaMetres | None = None


class Fixture(Struct, frozen=True, forbid_unknown_fields=True):
    """Two square detectors that see each other."""

    half_size_m: PartSize
    psd2_in_psd1: Pose


class Placement(Struct, frozen=True, forbid_unknown_fields=True):
    """One place where the fixture stood."""

    id: Identity
    psd1_in_base: Pose


class KnownDistance(Struct, frozen=True, forbid_unknown_fields=True):
    """A known distance: between the PSD 1 centres of two placements, two seats, or two parallel planes."""

    from_placement: Identity = field(name="from")
    to_placement: Identity = field(name="to")
    length_m: RoomSize
    sigma_m: SigmaMetres
    of: Literal["placement", "seat", "plane"] = "placement"


class KnownAngle(Struct, frozen=True, forbid_unknown_fields=True):
    """A known angle between two touched planes, up to a right angle."""

    from_plane: Identity = field(name="from")
    to_plane: Identity = field(name="to")
    angle_rad: Radians
    sigma_rad: SigmaRadians


class Bar(Struct, frozen=True, forbid_unknown_fields=True):
    """A calibrated length artefact."""

    id: Identity
    length_m: RoomSize


class BarPosition(Struct, frozen=True, forbid_unknown_fields=True):
    """One way in which a bar is set up; end a lies against `direction` (of any length but 0) from the middle."""

    id: Identity
    bar: Identity
    middle_m: RoomVector
    direction: Direction


class Seat(Struct, frozen=True, forbid_unknown_fields=True):
    """A cone for the probe's ball, about where it stands."""

    id: Identity
    origin_m: RoomVector


class Sphere(Struct, frozen=True, forbid_unknown_fields=True):
    """A calibrated sphere, about where its centre is."""

    id: Identity
    origin_m: RoomVector
    diameter_m: PartSize


class PermissibleErrors(Struct, frozen=True, forbid_unknown_fields=True):
    """Maximum permissible errors as the maker or the user states them; None: not stated, so nothing is judged."""

    p_form_m: SigmaMetres | None = None
    p_size_m: SigmaMetres | None = None
    l_dia_m: SigmaMetres | None = None
    e_uni_m: SigmaMetres | None = None  # of E_Uni = e_uni_m + e_uni_per_m * length
    e_uni_per_m: Share = 0.0
    effective_diameter_m: SigmaMetres | None = None  # ASME B89.4.22: greatest deviation
    single_point_m: SigmaMetres | None = None  # ASME B89.4.22: two standard deviations
    volumetric_m: SigmaMetres | None = None  # ASME B89.4.22: greatest deviation


class Noise(Struct, frozen=True, forbid_unknown_fields=True):
    """One sigma as assumed: a start value only. None: nothing is assumed."""

    psd_m: SigmaMetres | None = None
    position_m: SigmaMetres | None = None
    wire_m: SigmaMetres | None = None
    seat_m: SigmaMetres | None = None
    plane_m: SigmaMetres | None = None
    camera_m: tuple[SigmaMetres, SigmaMetres, SigmaMetres] | None = None  # along x, y, z of the camera
    camera_rad: tuple[SigmaRadians, SigmaRadians, SigmaRadians] | None = None  # about x, y, z of the camera
    joint_rad: SigmaRadians | None = None


class Tolerance(Struct, frozen=True, forbid_unknown_fields=True):
    """One sigma of the drawing: priors of the fit. What may be None is then taken as in `docs/formats.md`."""

    length_m: SigmaMetres
    angle_rad: SigmaRadians
    gain: Positive | None = None  # of both detectors' scales, about 1
    psd2_m: SigmaMetres | None = None  # of PSD 2 in PSD 1, with psd2_rad
    psd2_rad: SigmaRadians | None = None
    device_m: SigmaMetres | None = None  # of [device] in the base, with device_rad
    device_rad: SigmaRadians | None = None
    eccentricity_rad: SigmaRadians | None = None  # of an encoder's disc off its axis; None: centred
    mass_share: Positive | None = None  # of every stated mass, about 1
    com_m: SigmaMetres | None = None  # of every stated centre of mass


class CameraBoard(Struct, frozen=True, forbid_unknown_fields=True):
    """Square markers of one dictionary, printed in reading order, on the fixture.

    Its frame: origin in the middle of the markers, x right and y up as printed, z towards who reads it.
    """

    side_m: PartSize  # of the black square of one marker
    gap_m: PartSize  # of white between two
    in_psd1: Pose
    columns: Markers = 2
    rows: Markers = 2
    first_id: Count = 0
    dictionary: Literal["aruco-4x4-50", "apriltag-36h11"] = "aruco-4x4-50"


class Camera(Struct, frozen=True, forbid_unknown_fields=True):
    """The camera on the flange for coarse aim, roughly as mounted; `calibration` is what sessions go by."""

    source: Count | FilePath  # number of a video device, URL, or path of a picture or film
    width_px: Pixels
    height_px: Pixels
    view_rad: Annotated[float, Meta(ge=1e-3, lt=3.0)]  # across the width, as the data sheet states
    in_flange: Pose  # x right in the picture, y down, z where it looks
    board: CameraBoard
    calibration: FilePath | None = None  # file of `calibeam camera`
    latency_s: Seconds = 0.2  # from exposure to program at most: four frames at 30 Hz


class MotionBox(Struct, frozen=True, forbid_unknown_fields=True):
    """A box along the axes of the base that no part of the arm may enter."""

    name: Name
    lower_m: Vector
    upper_m: Vector


class SlowBox(Struct, frozen=True, forbid_unknown_fields=True):
    """A box along the axes of the base in which the tool is slow."""

    name: Name
    lower_m: Vector
    upper_m: Vector
    speed_m_s: Speed


class Motion(Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of every motion. The defaults are slow: nobody has stated yet what this cell allows."""

    speed_rad_s: Speed = 0.5
    acceleration_rad_s2: Acceleration = 1.0
    step_limit_rad: RadiansAbove = 0.1  # largest joint step of the centring servo
    home_rad: PerJoint[Radians] | None = None  # joint readings clear of everything, where a session starts
    line_speed_m_s: Speed = 0.25  # of the tool on straight lines: ISO 10218-1, reduced speed
    structural_hz: Hertz = 10.0  # lowest resonance of the arm; feels right for 1 m of reach until it is measured
    lag_s: Seconds = 0.0  # by which the arm follows streamed set-points (`calibeam motion`); 0: not measured
    clearance_m: MetresOrNone = 0.06  # half the width of the arm's links, kept between their middle and every keep_out
    keep_out: Few[MotionBox] = ()
    slow_area: Few[SlowBox] = ()


class Live(Struct, frozen=True, forbid_unknown_fields=True):
    """What the live page may do to a session beside its STOP."""

    stop_without_page_s: SecondsAbove | None = None  # no page answers for so long: as STOP; None: pages come and go


class SiteInstrument(Struct, frozen=True, forbid_unknown_fields=True):
    """One instrument as its own certificate names it."""

    name: Name
    serial_number: Name | None = None
    calibrated: date | None = None  # day of its last calibration
    certificate: Name | None = None  # number of that calibration's certificate


class Site(Struct, frozen=True, forbid_unknown_fields=True):
    """Who measured which robot, where and with what: for the certificate alone, nothing is computed from it.

    The robot's serial number is `[arm] serial_number`.
    """

    operator: Name | None = None
    place: Name | None = None
    robot: Name | None = None  # make and model, as on the maker's plate
    instruments: Few[SiteInstrument] = field(name="instrument", default=())


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
    "controller_link2_length_m",
    "laser_power_w",
    "camera_origin_sigma_m",
    "camera_rotation_sigma_rad",
    "camera_focal_sigma",
    "camera_centre_sigma_px",
    "camera_barrel",
    "camera_blur_px",
    "camera_noise_grey",
    "board_origin_sigma_m",
    "board_rotation_sigma_rad",
    "disc_eccentricity_m",
    "graduation_rad",
    "encoder_noise_rad",
    "axis_wobble_rad",
    "radial_runout_m",
    "axial_runout_m",
    "contact_m",
    "tremor_rad",
    "slip_share",
    "artefact_sigma_m",
    "hand_force_n",
    "joint_compliance_rad_nm",
    "position_noise_m",
    "target_sigma_m",
    "device_origin_sigma_m",
    "device_rotation_sigma_rad",
)


class Rig(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole rig file. Sections that are absent are None, empty, or a record of defaults."""

    schema: Literal[1]
    name: Name
    arm: Arm = NO_ARM
    tool: Tool = Tool()
    target_list: Few[FlangeTarget] = field(name="target", default=())
    fixture: Fixture | None = None
    placement_list: Few[Placement] = field(name="placement", default=())
    device: Pose | None = None  # measuring device of position and wire observations, in the base frame
    known_distances: Few[KnownDistance] = field(name="known_distance", default=())
    known_angles: Few[KnownAngle] = field(name="known_angle", default=())
    bar_list: Few[Bar] = field(name="bar", default=())
    bar_position_list: Few[BarPosition] = field(name="bar_position", default=())
    seat_list: Few[Seat] = field(name="seat", default=())
    sphere_list: Few[Sphere] = field(name="sphere", default=())
    mpe: PermissibleErrors = PermissibleErrors()
    noise: Noise = Noise()
    tolerance: Tolerance | None = None
    devices: Devices = Devices()
    camera: Camera | None = None
    motion: Motion = Motion()
    live: Live = Live()
    site: Site = Site()
    emulation: Mapping[Name, Number] | None = None

    @property
    def n_joints(self) -> int:
        """0 of a rig without an arm."""
        return len(self.arm.joints)

    @property
    def n_encoders(self) -> int:
        """One a joint; of a rig without an arm as many as are named."""
        return self.n_joints or (0 if self.devices.encoders is None else len(self.devices.encoders.named))

    @property
    def placements(self) -> Mapping[int, Placement]:
        """By id, in the order of the file."""
        return {placement.id: placement for placement in self.placement_list}

    @property
    def bars(self) -> Mapping[int, Bar]:
        """By id, in the order of the file."""
        return {bar.id: bar for bar in self.bar_list}

    @property
    def targets(self) -> Mapping[int, FlangeTarget]:
        """By id, in the order of the file."""
        return {target.id: target for target in self.target_list}

    @property
    def seats(self) -> Mapping[int, Seat]:
        """By id, in the order of the file."""
        return {seat.id: seat for seat in self.seat_list}

    @property
    def bar_positions(self) -> Mapping[int, BarPosition]:
        """By id, in the order of the file."""
        return {position.id: position for position in self.bar_position_list}

    @property
    def spheres(self) -> Mapping[int, Sphere]:
        """By id, in the order of the file."""
        return {sphere.id: sphere for sphere in self.sphere_list}
