"""The arms that a session may be drawn for, as their makers draw them."""

import math

from simulators.arm.drawing import Drawing, Row

QUARTER = 0.5 * math.pi
NO_POSE = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _rad(*degrees: float) -> tuple[float, ...]:
    return tuple(math.radians(value) for value in degrees)


# ABB product specification IRB 120 (3HAC035960); masses and centres: ROS-Industrial abb_irb120_support. ABB publishes
# no gear ratios: those of the strain-wave and planetary sets that such arms carry.
IRB120 = Drawing(
    name="irb120",
    model="dh",
    rows=(
        Row(0.0, -QUARTER, 0.290),
        Row(0.270, 0.0, 0.0, -QUARTER),
        Row(0.070, -QUARTER, 0.0),
        Row(0.0, QUARTER, 0.302),
        Row(0.0, -QUARTER, 0.0),
        Row(0.0, 0.0, 0.072, math.pi),
    ),
    fixed=(),
    flange=NO_POSE,
    lower_rad=_rad(-165, -110, -110, -160, -120, -180),
    upper_rad=_rad(165, 110, 70, 160, 120, 180),
    mass_kg=(3.067, 3.909, 2.944, 1.328, 0.547, 0.137),
    com_m=(
        (0.0, 0.051, 0.0),
        (-0.169, 0.001, 0.0),
        (-0.012, 0.002, -0.023),
        (0.0, 0.077, 0.001),
        (0.0, 0.0, 0.001),
        (0.0, 0.0, -0.007),
    ),
    gear_ratio=(121.0, 121.0, 101.0, 50.0, 51.0, 50.0),
    reach_m=0.58,
)

# Universal Robots, "DH parameters for calculations of kinematics and dynamics", UR5e, put into Craig's notation.
UR5 = Drawing(
    name="ur5",
    model="mdh",
    rows=(
        Row(0.0, 0.0, 0.1625),
        Row(0.0, QUARTER, 0.0),
        Row(-0.425, 0.0, 0.0),
        Row(-0.3922, 0.0, 0.1333),
        Row(0.0, QUARTER, 0.0997),
        Row(0.0, -QUARTER, 0.0996),
    ),
    fixed=(),
    flange=NO_POSE,
    lower_rad=_rad(-180, -180, -150, -180, -180, -180),
    upper_rad=_rad(180, 0, 150, 180, 180, 180),
    mass_kg=(3.761, 8.058, 2.846, 1.37, 1.3, 0.365),
    com_m=(
        (0.0, -0.00193, -0.02561),
        (-0.2125, 0.0, 0.11336),
        (-0.2422, 0.0, 0.0265),
        (0.0, -0.01634, -0.0018),
        (0.0, 0.01634, -0.0018),
        (0.0, 0.0, -0.001159),
    ),
    gear_ratio=(101.0,) * 6,
    reach_m=0.85,
)

# A foundry arm of 2.5 m reach after ABB's data sheet IRB 4600-45/2.05...2.55; masses shared out of its 435 kg.
LARGE = Drawing(
    name="large",
    model="dh",
    rows=(
        Row(0.175, -QUARTER, 0.495),
        Row(1.095, 0.0, 0.0, -QUARTER),
        Row(0.175, -QUARTER, 0.0),
        Row(0.0, QUARTER, 1.2305),
        Row(0.0, -QUARTER, 0.0),
        Row(0.0, 0.0, 0.135, math.pi),
    ),
    fixed=(),
    flange=NO_POSE,
    lower_rad=_rad(-180, -90, -160, -200, -125, -200),
    upper_rad=_rad(180, 130, 70, 200, 120, 200),
    mass_kg=(110.0, 75.0, 90.0, 30.0, 10.0, 3.0),
    com_m=(
        (-0.1, 0.15, 0.0),
        (-0.6, 0.0, 0.05),
        (-0.02, 0.0, 0.02),
        (0.0, 0.5, 0.0),
        (0.0, 0.0, 0.01),
        (0.0, 0.0, -0.02),
    ),
    gear_ratio=(131.0, 131.0, 121.0, 82.0, 71.0, 50.0),
    reach_m=2.5,
)

# Huang Kui et al., error simulation of a flexible arm coordinate measuring machine: the reference arm. No drives.
CYCLE_BACK = (-1.2091995761561452, -1.2091995761561452, -1.2091995761561452)  # 120 deg about (1, 1, 1)
CYCLE_ON = (1.2091995761561452, 1.2091995761561452, 1.2091995761561452)
ARM_CMM = Drawing(
    name="arm-cmm",
    model="local-poe",
    rows=(),
    fixed=(
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((0.074, 0.0, 0.176), CYCLE_BACK),
        ((0.0, 0.0, 0.0), CYCLE_ON),
        ((0.0695, 0.0, 0.585), CYCLE_BACK),
        ((0.0, 0.0, 0.0), CYCLE_ON),
        ((0.0, 0.0, 0.475), CYCLE_BACK),
    ),
    flange=((0.1465, 0.0, 0.076), (0.0, 0.0, 0.0)),
    lower_rad=_rad(-180, -130, -180, -140, -180, -130),
    upper_rad=_rad(180, 130, 180, 140, 180, 130),
    mass_kg=(),
    com_m=(),
    gear_ratio=(),
    reach_m=1.1,
)

ROBOTS = (IRB120, UR5, LARGE)
