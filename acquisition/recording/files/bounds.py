"""Bounds of all that is read from files: every number, text and list, once, as the types of the files' records.

A bound is generous: no machine or laboratory comes near it, and beyond it the value is a slip of the pen or damage.
Within the bounds the arithmetic of all commands stays finite. The table for users stands in docs/formats.md.
"""

from typing import Annotated, TypeVar

from msgspec import Meta

LENGTH_M = 1e3  # 1 km; the longest laser trackers measure 160 m
# Of a rig file, closer than LENGTH_M: its usual slip are millimetres, which make a length a thousand times too long
ROOM_M = 200.0  # what stands about an arm: the longest laser trackers measure 160 m
ARM_M = 20.0  # a link, or what a flange or fixture carries: the longest arm (Canadarm2) measures 17.6 m stretched out
PART_M = 1.0  # a detector's face, a probe's ball, a marker: the largest are some 0.3 m
ANGLE_RAD = 1e5  # 16,000 turns: an encoder on the motor, over the whole travel of an axis with a gear
TIME_S = 9e9  # s since 1970 until 2255, or since the start; nanoseconds of it fit into 64 bits
SPAN_S = 1e8  # three years: no session lasts so long, and a time beyond counts from 1970 or the like
SETTING_S = 1e5  # a day: of a setting such as a latency
MASS_KG = 1e6  # the heaviest robots carry 2,300 kg
TEMPERATURE_DEGC = 1e4  # beyond any sensor; devices' own marks for "no reading" (-999) lie within
VOLTAGE_V = 1e6
POWER_W = 1e6
SPEED = 1e6  # m/s or rad/s
ACCELERATION = 1e9  # m/s2 or rad/s2
FREQUENCY_HZ = 1e9
PICTURE_PX = 1e5  # sides of a picture: line cameras reach 16,000
NUMBER = 1e20  # of an unknown unit; counters of 64 bits reach 1.8e19
STATISTIC = 1e100  # chi-square, condition, p: derived, only shown; a square of it is still finite
COUNT = 10**15  # a thousand samples a second for 30,000 years
JOINTS = 16  # serial arms have 5 to 9
FEW = 1_000  # places, boxes, cones: what a person measures one by one
MANY = 1_000_000  # poses, rows, names of parameters: what a program lists
# Of what one file holds when it is unpacked: any of 32 MB is read in 1 GB and 60 s
TABLE_BYTES = 32_000_000  # of a table as text: 10,000 rows of 60 columns have 12 MB
TABLE_CELLS = 4_000_000  # that become objects of 60 bytes
TABLE_COLUMNS = 4_000
TABLE_TEXT = 20_000  # bytes of a cell
UNPACKED_BYTES = 256_000_000
BATCH_BYTES = 64_000_000  # of a compressed piece: a writer that waits for the disk has as much, else 1 MB
MESSAGES = 1_000_000  # of a recording, a bag or a log; an hour of five streams has 720,000
SMALLEST_M = 1e-9  # of a length that a body has
SMALLEST_SIGMA = 1e-15  # m or rad: a thousandth of what the best interferometers resolve; weights stay finite
SMALLEST_RATE = 1e-9  # rad/s, m/s, Hz: below, a motion has no end

# Largest magnitude by the unit in which a name ends: columns of samples, keys of [emulation].
BY_UNIT = {
    "_m": LENGTH_M,
    "_rad": ANGLE_RAD,
    "_s": TIME_S,
    "_kg": MASS_KG,
    "_degC": TEMPERATURE_DEGC,
    "_v": VOLTAGE_V,
    "_w": POWER_W,
    "_px": PICTURE_PX,
    "_hz": FREQUENCY_HZ,
    "_m_s": SPEED,
    "_rad_s": SPEED,
    "_m_s2": ACCELERATION,
    "_rad_s2": ACCELERATION,
}
_BY_LENGTH = sorted(BY_UNIT, key=len, reverse=True)

# Lengths and angles
Metres = Annotated[float, Meta(ge=-LENGTH_M, le=LENGTH_M)]
MetresOrNone = Annotated[float, Meta(ge=0.0, le=LENGTH_M)]  # 0: there is none of it
Size = Annotated[float, Meta(ge=SMALLEST_M, le=LENGTH_M)]  # m
RoomSize = Annotated[float, Meta(ge=SMALLEST_M, le=ROOM_M)]
PartSize = Annotated[float, Meta(ge=SMALLEST_M, le=PART_M)]
PartSizeOrNone = Annotated[float, Meta(ge=0.0, le=PART_M)]  # 0: a point
RoomMetres = Annotated[float, Meta(ge=-ROOM_M, le=ROOM_M)]
ArmMetres = Annotated[float, Meta(ge=-ARM_M, le=ARM_M)]
Radians = Annotated[float, Meta(ge=-ANGLE_RAD, le=ANGLE_RAD)]
RadiansAbove = Annotated[float, Meta(ge=SMALLEST_RATE, le=ANGLE_RAD)]
RadiansOrNone = Annotated[float, Meta(ge=0.0, le=ANGLE_RAD)]
SigmaMetres = Annotated[float, Meta(ge=SMALLEST_SIGMA, le=LENGTH_M)]
SigmaRadians = Annotated[float, Meta(ge=SMALLEST_SIGMA, le=ANGLE_RAD)]
Vector = tuple[Metres, Metres, Metres]
RoomVector = tuple[RoomMetres, RoomMetres, RoomMetres]
ArmVector = tuple[ArmMetres, ArmMetres, ArmMetres]
Rotation = tuple[Radians, Radians, Radians]  # rotation vector
Direction = tuple[Metres, Metres, Metres]  # of any length but 0; made a unit vector where it is used
ZERO: Vector = (0.0, 0.0, 0.0)

# Other quantities
Kilograms = Annotated[float, Meta(ge=0.0, le=MASS_KG)]
Seconds = Annotated[float, Meta(ge=0.0, le=SETTING_S)]
SecondsAbove = Annotated[float, Meta(ge=1e-6, le=SETTING_S)]
Instant = Annotated[float, Meta(ge=-TIME_S, le=TIME_S)]  # s, on any clock
Hertz = Annotated[float, Meta(ge=SMALLEST_RATE, le=FREQUENCY_HZ)]
Volts = Annotated[float, Meta(ge=1e-12, le=VOLTAGE_V)]
Speed = Annotated[float, Meta(ge=SMALLEST_RATE, le=SPEED)]
Acceleration = Annotated[float, Meta(ge=SMALLEST_RATE, le=ACCELERATION)]
Gravity = tuple[
    Annotated[float, Meta(ge=-1e3, le=1e3)],  # m/s2; the sun's is 274
    Annotated[float, Meta(ge=-1e3, le=1e3)],
    Annotated[float, Meta(ge=-1e3, le=1e3)],
]
GearRatio = Annotated[float, Meta(ge=1e-6, le=1e6)]  # motor turns a joint turn; the largest of robots are some 300
Factor = Annotated[float, Meta(ge=-1e12, le=1e12)]  # SI value over a device's number
PositiveFactor = Annotated[float, Meta(ge=1e-12, le=1e12)]
Expansion = Annotated[float, Meta(ge=1e-12, le=1.0)]  # 1/K; plastics reach 2e-4
Kelvin = Annotated[float, Meta(ge=-TEMPERATURE_DEGC, le=TEMPERATURE_DEGC)]  # a difference
KelvinOrNone = Annotated[float, Meta(ge=0.0, le=TEMPERATURE_DEGC)]
Order = Annotated[float, Meta(ge=1e-6, le=1e6)]  # cycles a turn; the finest encoders have 100,000 lines
Share = Annotated[float, Meta(ge=0.0, le=1.0)]

# Numbers and names
Number = Annotated[float, Meta(ge=-NUMBER, le=NUMBER)]
NotNegative = Annotated[float, Meta(ge=0.0, le=NUMBER)]
Positive = Annotated[float, Meta(ge=1e-20, le=NUMBER)]
Correction = Annotated[float, Meta(ge=-1e6, le=1e6)]  # m, rad or a factor, about what a rig or a form states
Statistic = Annotated[float, Meta(ge=-STATISTIC, le=STATISTIC)]
Count = Annotated[int, Meta(ge=0, le=COUNT)]
Whole = Annotated[int, Meta(ge=-COUNT, le=COUNT)]
Identity = Annotated[int, Meta(ge=1, le=10**9)]
Markers = Annotated[int, Meta(ge=1, le=100)]  # in a row of a board; the dictionaries hold 50 and 587
Pixels = Annotated[int, Meta(ge=16, le=int(PICTURE_PX))]
Name = Annotated[str, Meta(min_length=1, max_length=200)]  # shown in tables, figures and errors
Label = Annotated[str, Meta(max_length=200)]  # a name that may be empty
Line = Annotated[str, Meta(min_length=1, max_length=1000)]  # an equation of a task
FilePath = Annotated[str, Meta(min_length=1, max_length=1000)]  # or a URL
Sentence = Annotated[str, Meta(max_length=20_000)]  # for a person
FileText = Annotated[str, Meta(max_length=4_000_000)]  # a rig or plan to the letter

T = TypeVar("T")
PerJoint = Annotated[tuple[T, ...], Meta(max_length=JOINTS)]
Few = Annotated[tuple[T, ...], Meta(max_length=FEW)]
Many = Annotated[tuple[T, ...], Meta(max_length=MANY)]


def most_of(name: str) -> float:
    """The largest magnitude of a quantity by the unit in which its name ends: 1e3 of "x_m", NUMBER without a unit."""
    return next((BY_UNIT[unit] for unit in _BY_LENGTH if name.endswith(unit)), NUMBER)
