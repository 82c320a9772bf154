"""[devices] of a rig file as frozen records: which instruments there are, and how each is reached.

As in the rest of the file (schema.py), a key that is not declared here is refused.
"""

import enum
from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from acquisition.recording.files.bounds import (
    Acceleration,
    Factor,
    Few,
    FilePath,
    Hertz,
    Identity,
    Label,
    Name,
    Number,
    PerJoint,
    PositiveFactor,
    Size,
    Volts,
    Whole,
)

RegisterAddress = Annotated[int, Meta(ge=0, le=65535)]  # Modbus Application Protocol V1.1b3, section 4.4
RegisterCount = Annotated[int, Meta(ge=1, le=65536)]
NodeId = Annotated[int, Meta(ge=1, le=127)]  # CiA 301, 7.2
MaybePath = Annotated[str, Meta(max_length=1000)]  # as FilePath; empty: none
HARDWARE_STAMPS = ("ixxat", "kvaser", "pcan", "vector")  # python-can 4, "CAN Interface Modules": the adapter's own time
STAMPS_WHEN_ASKED = "slcan"  # by `Z1`


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


class RowStamp(enum.Enum):
    """Whose time a row of encoders has: of its arrival at this computer, or of the CAN adapter."""

    ARRIVED = "arrived"
    HARDWARE = "hardware"


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
    port: FilePath | None = None
    serial_number: Name | None = None
    rate_hz: Hertz = 1000.0  # where the 2 µm of a PSD are stated
    ports: tuple[FilePath, FilePath] | None = None
    serial_numbers: tuple[Name, Name] | None = None
    error_maps: tuple[MaybePath, MaybePath] | None = None  # files of both faces, "" for none
    spot_radius_m: Size | None = None  # at 1/e^2; only a quadrant face needs it
    head: PsdHead = PsdHead.PIN_CUSHION
    length_m: Size | None = None  # resistance length; None: twice fixture.half_size_m
    x_signs: tuple[Literal[-1, 1], Literal[-1, 1]] = (-1, -1)
    y_signs: tuple[Literal[-1, 1], Literal[-1, 1]] = (1, 1)
    sum_full_scale_v: tuple[Volts, Volts] = (10.0, 10.0)  # at 65535 counts
    transimpedance_v_a: PositiveFactor = 1e5  # Thorlabs PDP90A; it places no spot


class EncodersDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The encoders' CAN bus; `interface` and `channel` are python-can's words; a node, or signal, per joint, in order
    (of a rig without an arm: per encoder).

    `serial_number` of a serial adapter's USB plug stands in place of `channel`, which changes with the plug.
    """

    driver: EncoderDriver
    interface: Name
    channel: MaybePath = ""  # empty: by serial number
    nodes: PerJoint[NodeId] = ()
    bitrate: Identity = 1_000_000
    sync_hz: Hertz = 200.0
    serial_number: Name | None = None
    options: Mapping[Name, bool | Whole | Number | Label] = {}  # further words of python-can for this interface
    dbc: FilePath | None = None  # file that describes plain encoders
    signals: PerJoint[Name] = ()  # "Message.Signal" of the DBC file
    units_per_turn: PositiveFactor | None = None  # for signals whose unit is no angle, and CiA 406 logs without set-up
    acceleration_limit_rad_s2: Acceleration | None = None  # beyond it a step is a slip, not motion
    stamp: RowStamp | None = None  # only of can-dbc; None: arrived

    @property
    def stamped_by_adapter(self) -> bool:
        """Whether rows have the adapter's time, and not this computer's."""
        return self.stamp is RowStamp.HARDWARE

    @property
    def named(self) -> tuple[int, ...] | tuple[str, ...]:
        """Nodes, or signals, by the driver."""
        return self.signals if self.driver is EncoderDriver.CAN_DBC else self.nodes


class RobotRegister(Struct, frozen=True, forbid_unknown_fields=True):
    """One entry of a Modbus register map; SI value = scale * number. Names: `docs/protocols/modbus.md`."""

    name: Name
    address: RegisterAddress
    type: RegisterType
    count: RegisterCount = 1
    scale: Factor = 1.0
    word_order: Literal["big", "little"] = "big"  # which word of a longer number comes first
    table: Literal["holding", "input"] = "holding"
    turns_address: RegisterAddress | None = None  # first of the counts of whole turns that belong to angles


class RobotDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """The controller's address and the rate of its stream; the keys from `port` on are for Modbus only."""

    driver: RobotDriver
    host: Name | None = None
    rate_hz: Hertz = 500.0  # e-Series control cycle
    port: Annotated[int, Meta(ge=0, le=65535)] | None = None  # of Modbus TCP, 502 when not given
    serial_port: FilePath | None = None  # Modbus RTU instead of TCP
    serial_number: Name | None = None  # of the RTU adapter's USB plug, in place of serial_port
    baud: Identity = 115_200
    parity: Literal["none", "even", "odd"] = "none"
    stop_bits: Literal[1, 2] = 1
    unit: Annotated[int, Meta(ge=0, le=255)] = 1
    read_across: Annotated[int, Meta(ge=0, le=123)] = 0  # registers outside the map that may be read in one go
    registers: Few[RobotRegister] = field(name="register", default=())

    @property
    def is_rtu(self) -> bool:
        """Modbus on a serial line."""
        return self.serial_port is not None or self.serial_number is not None


class TrackerDriver(enum.Enum):
    """How an instrument that measures positions prints them."""

    ASCII_LINES = "ascii-lines"
    JSON_LINES = "json-lines"


class TrackerDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """A laser tracker or camera that prints the position of its target line by line: docs/tracker.md.

    Over TCP (`host`, `port`: it listens), UDP (it sends to `port` of this machine), or a serial line.
    """

    driver: TrackerDriver
    length_unit: Literal["m", "mm", "um", "in"]  # no default: a wrong one is a thousandfold
    columns: Few[Name] = ()  # of ascii-lines, in order: x, y, z, time, status, temperature, "-" for one to ignore
    members: Mapping[Name, Name] = {}  # of json-lines: the same names, and the path to each member
    host: Name | None = None
    port: Annotated[int, Meta(ge=0, le=65535)] | None = None
    transport: Literal["tcp", "udp"] = "tcp"
    serial_port: FilePath | None = None
    serial_number: Name | None = None  # of the serial adapter's USB plug, in place of serial_port
    baud: Identity = 115_200
    rate_hz: Hertz = 100.0  # of its stream, or of the triggers
    separator: Annotated[str, Meta(min_length=1, max_length=1)] = ","  # " ": any run of blanks
    decimal: Literal[".", ","] = "."
    time_unit: Literal["s", "ms", "us"] = "s"
    good: Few[Name] = ()  # words of the status column that mean a valid reading
    start: Label = ""  # written once after connecting
    stop: Label = ""  # and before hanging up
    trigger: Label = ""  # before every reading; empty: it streams by itself

    @property
    def is_serial(self) -> bool:
        return self.serial_port is not None or self.serial_number is not None


class OtherDevice(Struct, frozen=True, forbid_unknown_fields=True):
    """An instrument of a plug-in, recorded beside the others. Its package states which settings it takes."""

    name: Annotated[str, Meta(pattern="^[a-z][a-z0-9_-]{0,31}$")]  # of its stream, and of its temperatures' columns
    driver: Name  # entry point of the group calibeam.devices
    settings: Mapping[Name, bool | Whole | Number | Label | Few[bool | Whole | Number | Label]] = {}


class Devices(Struct, frozen=True, forbid_unknown_fields=True):
    """How each instrument is reached; one that is not named is not there."""

    psd: PsdDevice | None = None
    encoders: EncodersDevice | None = None
    robot: RobotDevice | None = None
    tracker: TrackerDevice | None = None
    others: Few[OtherDevice] = field(name="other", default=())
