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
RegisterAddress = Annotated[int, Meta(ge=0, le=65535)]  # Modbus Application Protocol V1.1b3, section 4.4
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
    probe_diameter_m: NotNegative | None = None  # of the ball whose centre is `point_m`


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


class BarPosition(Struct, frozen=True, forbid_unknown_fields=True):
    """One way in which a bar is set up; end a lies against `direction` (of any length but 0) from the middle."""

    id: Identity
    bar: Identity
    middle_m: Vector
    direction: Vector


class Seat(Struct, frozen=True, forbid_unknown_fields=True):
    """A cone for the probe's ball, about where it stands."""

    id: Identity
    origin_m: Vector


class Sphere(Struct, frozen=True, forbid_unknown_fields=True):
    """A calibrated sphere, about where its centre is."""

    id: Identity
    origin_m: Vector
    diameter_m: Positive


class PermissibleErrors(Struct, frozen=True, forbid_unknown_fields=True):
    """Maximum permissible errors as the maker or the user states them; None: not stated, so nothing is judged."""

    p_form_m: Positive | None = None
    p_size_m: Positive | None = None
    l_dia_m: Positive | None = None
    e_uni_m: Positive | None = None  # of E_Uni = e_uni_m + e_uni_per_m * length
    e_uni_per_m: NotNegative = 0.0
    effective_diameter_m: Positive | None = None  # ASME B89.4.22: greatest deviation
    single_point_m: Positive | None = None  # ASME B89.4.22: two standard deviations
    volumetric_m: Positive | None = None  # ASME B89.4.22: greatest deviation


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
    eccentricity_rad: Positive | None = None  # of what an encoder's disc off its axis does to a reading; None: centred


class PsdDriver(enum.Enum):
    """Detector electronics that can be read."""

    PSD_DAQ = "psd-daq"
    KPA101 = "kpa101"


class PsdHead(enum.Enum):
    """Detector heads that a KPA101 takes."""

    PIN_CUSHION = "pin-cushion"
    QUADRANT = "quadrant"


class EncoderDriver(enum.Enum):
    """Encoder profiles that can be read."""

    CIA406 = "cia406"
    CAN_DBC = "can-dbc"


class RobotDriver(enum.Enum):
    """Controllers that can be driven."""

    UR_RTDE = "ur-rtde"
    MODBUS = "modbus"


class RegisterType(enum.Enum):
    """How a number stands in 16-bit registers."""

    INT16 = "int16"
    UINT16 = "uint16"
    INT32 = "int32"
    UINT32 = "uint32"
    FLOAT32 = "float32"
    FLOAT64 = "float64"


class PsdDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The detectors' serial line, by path or by USB serial number; of a pair of KPA101 two lines, unit 1 first.

    Keys of two numbers are for unit 1 and 2, and from `head` on for KPA101 only: docs/protocols/kpa101.md.
    """

    driver: PsdDriver
    port: Word | None = None
    serial_number: Word | None = None
    rate_hz: Positive = 1000.0  # where the 2 um of a PSD are stated
    ports: tuple[Word, Word] | None = None
    serial_numbers: tuple[Word, Word] | None = None
    error_maps: tuple[str, str] | None = None  # files of both faces, "" for none
    spot_radius_m: Positive | None = None  # at 1/e^2; only a quadrant face needs it
    head: PsdHead = PsdHead.PIN_CUSHION
    length_m: Positive | None = None  # resistance length; None: twice fixture.half_size_m
    x_signs: tuple[Literal[-1, 1], Literal[-1, 1]] = (-1, -1)
    y_signs: tuple[Literal[-1, 1], Literal[-1, 1]] = (1, 1)
    sum_full_scale_v: tuple[Positive, Positive] = (10.0, 10.0)  # at 65535 counts
    transimpedance_v_a: Positive = 1e5  # Thorlabs PDP90A; it places no spot


class EncodersDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The encoders' CAN bus; `interface` and `channel` are python-can's words; a node, or signal, per joint, in order.

    `serial_number` of a serial adapter's USB plug stands in place of `channel`, which changes with the plug.
    """

    driver: EncoderDriver
    interface: Word
    channel: str = ""  # empty: by serial number
    nodes: tuple[Annotated[int, Meta(ge=1, le=127)], ...] = ()  # CiA 301, 7.2: node-IDs 1 to 127
    bitrate: Identity = 1_000_000
    sync_hz: Positive = 200.0
    serial_number: Word | None = None
    options: Mapping[str, bool | int | float | str] = {}  # further words of python-can for this interface
    dbc: Word | None = None  # file that describes plain encoders
    signals: tuple[Word, ...] = ()  # "Message.Signal" of the DBC file
    units_per_turn: Positive | None = None  # for signals whose unit is no angle
    acceleration_limit_rad_s2: Positive | None = None  # beyond it a step is a slip, not motion


class RobotRegister(Struct, frozen=True, forbid_unknown_fields=True):
    """One entry of a Modbus register map; SI value = scale * number. Names: `docs/protocols/modbus.md`."""

    name: Word
    address: RegisterAddress
    type: RegisterType
    count: Identity = 1
    scale: float = 1.0
    word_order: Literal["big", "little"] = "big"  # which word of a longer number comes first
    table: Literal["holding", "input"] = "holding"
    turns_address: RegisterAddress | None = None  # first of the counts of whole turns that belong to angles


class RobotDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The controller's address and the rate of its stream; the keys from `port` on are for Modbus only."""

    driver: RobotDriver
    host: Word | None = None
    rate_hz: Positive = 500.0  # e-Series control cycle
    port: Annotated[int, Meta(ge=0, le=65535)] | None = None  # of Modbus TCP, 502 when not given
    serial_port: Word | None = None  # Modbus RTU instead of TCP
    baud: Identity = 115_200
    unit: Annotated[int, Meta(ge=0, le=255)] = 1
    read_across: Annotated[int, Meta(ge=0, le=123)] = 0  # registers outside the map that may be read in one go
    registers: tuple[RobotRegister, ...] = field(name="register", default=())


class Devices(Struct, frozen=True, forbid_unknown_fields=True):
    """How each instrument is reached; one that is not named is not there."""

    psd: PsdDevice | None = None
    encoders: EncodersDevice | None = None
    robot: RobotDevice | None = None


class CameraBoard(Struct, frozen=True, forbid_unknown_fields=True):
    """Square markers of one dictionary, printed in reading order, on the fixture.

    Its frame: origin in the middle of the markers, x right and y up as printed, z towards who reads it.
    """

    side_m: Positive  # of the black square of one marker
    gap_m: Positive  # of white between two
    in_psd1: Pose
    columns: Identity = 2
    rows: Identity = 2
    first_id: Annotated[int, Meta(ge=0)] = 0
    dictionary: Literal["aruco-4x4-50", "apriltag-36h11"] = "aruco-4x4-50"


class Camera(Struct, frozen=True, forbid_unknown_fields=True):
    """The camera on the flange for coarse aim, roughly as mounted; `calibration` is what sessions go by."""

    source: Annotated[int, Meta(ge=0)] | Word  # number of a video device, URL, or path of a picture or film
    width_px: Annotated[int, Meta(ge=16)]
    height_px: Annotated[int, Meta(ge=16)]
    view_rad: Annotated[float, Meta(gt=0.0, lt=3.0)]  # across the width, as the data sheet says
    in_flange: Pose  # x right in the picture, y down, z where it looks
    board: CameraBoard
    calibration: Word | None = None  # file of `calibeam camera`


class MotionBox(Struct, frozen=True, forbid_unknown_fields=True):
    """A box along the axes of the base that no part of the arm may enter."""

    name: Word
    lower_m: Vector
    upper_m: Vector


class SlowBox(Struct, frozen=True, forbid_unknown_fields=True):
    """A box along the axes of the base in which the tool is slow."""

    name: Word
    lower_m: Vector
    upper_m: Vector
    speed_m_s: Positive


class Motion(Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of every motion. The defaults are slow: nobody has said yet what this cell allows."""

    speed_rad_s: Positive = 0.5
    acceleration_rad_s2: Positive = 1.0
    step_limit_rad: Positive = 0.1  # largest joint step of the centring servo
    home_rad: tuple[float, ...] | None = None  # joint readings clear of everything, where a session starts
    line_speed_m_s: Positive = 0.25  # of the tool on straight lines: ISO 10218-1, reduced speed
    structural_hz: Positive = 10.0  # lowest resonance of the arm; feels right for 1 m of reach until it is measured
    lag_s: NotNegative = 0.0  # by which the arm follows streamed set-points (`calibeam motion`); 0: not measured
    clearance_m: NotNegative = 0.06  # half the width of the arm's links, kept between their middle and every keep_out
    keep_out: tuple[MotionBox, ...] = ()
    slow_area: tuple[SlowBox, ...] = ()


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
    "contact_m",
    "tremor_rad",
    "slip_share",
    "artefact_sigma_m",
    "hand_force_n",
    "joint_compliance_rad_nm",
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
    bar_position_list: tuple[BarPosition, ...] = field(name="bar_position", default=())
    seat_list: tuple[Seat, ...] = field(name="seat", default=())
    sphere_list: tuple[Sphere, ...] = field(name="sphere", default=())
    mpe: PermissibleErrors = PermissibleErrors()
    noise: Noise = Noise()
    tolerance: Tolerance | None = None
    devices: Devices = Devices()
    camera: Camera | None = None
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
