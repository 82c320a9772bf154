"""What a joint has to move or hold beside the nominal links: rotors, a payload, leaning gravity, springs and hoses."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Form, Shape, Term
from calibrate.model.effects.torque.motion_drivers import MotionDrivers, at_joints, joints

LIMIT_KG_M2 = 1e3  # of a rotor behind its gear: 0.012 kg m² times 270 squared is 875 kg m² (Weigand et al., KR 300)
LIMIT_KG = 500.0
LIMIT_RAD = 0.2
LIMIT_NM_PER_RAD = 5e3


def _rotor(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "rotor-inertia",
        Shape.LINEAR,
        ("qdd{joint}",),
        lambda d, inner, i: d.qdd_rad_s2[:, i - 1 : i],
        ("inertia_kg_m2",),
        LIMIT_KG_M2,
        "Joint {joint} is harder to accelerate than its links by {inertia_kg_m2}: rotor and gear",
        reversed_sentence="Joint {joint} is easier to accelerate than its model by {inertia_kg_m2}: rotor and gear",
    )


def _payload(drivers: Drivers) -> tuple[Term, ...]:
    return (
        Form(
            Port("tool.load", Place.JOINTS),
            (",".join(f"q{i}" for i in joints(drivers)),),
            Shape.LINEAR,
            "payload",
            function=lambda d, inner: _motion(d).last_link,
            names=(
                *("mass_kg", "moment_x_kg_m", "moment_y_kg_m", "moment_z_kg_m"),
                *(f"tensor_{axes}_kg_m2" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
            ),
            limit=LIMIT_KG,
            sentence="The flange carries {mass_kg} more than its model, with first moments of {moment_x_kg_m}, "
            "{moment_y_kg_m}, {moment_z_kg_m} along x, y, z of the flange",
        ),
    )


def _gravity(drivers: Drivers) -> tuple[Term, ...]:
    return (
        Form(
            Port("base.lean", Place.JOINTS),
            (",".join(f"q{i}" for i in joints(drivers)),),
            Shape.LINEAR,
            "gravity-direction",
            function=lambda d, inner: _motion(d).tilted,
            names=("lean_x_rad", "lean_y_rad"),
            limit=LIMIT_RAD,
            sentence="Gravity leans by {lean_x_rad} about x and {lean_y_rad} about y of the base: the arm does not "
            "stand as the rig file has it",
        ),
    )


def _spring(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "joint-spring",
        Shape.LINEAR,
        ("q{joint}",),
        lambda d, inner, i: np.stack([d.q_rad[:, i - 1] - d.middle_rad[i - 1], np.ones(len(d.t_s))], axis=1),
        ("stiffness_nm_per_rad", "level_nm"),
        LIMIT_NM_PER_RAD,
        "Joint {joint} is pulled back by {stiffness_nm_per_rad}, {level_nm} in the middle of its motion: spring, hose "
        "or cables",
        reversed_sentence="Joint {joint} is pushed on by {stiffness_nm_per_rad}: a spring that balances",
    )


def _motion(drivers: Drivers) -> MotionDrivers:
    if not isinstance(drivers, MotionDrivers):
        raise TypeError("a torque without a motion")
    return drivers


ROTOR = Kind(
    "rotor-inertia",
    "A rotor turns by the ratio of its gear faster than the joint: its inertia counts by the square of the ratio.",
    ("viscous-friction", "torque-constant"),
    "Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, 2006, section 6.1",
    _rotor,
)
PAYLOAD = Kind(
    "payload",
    "What the flange carries weighs on every joint in front of it, and has to be accelerated.",
    ("torque-constant", "gravity-direction"),
    "Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, section 12.8",
    _payload,
)
GRAVITY = Kind(
    "gravity-direction",
    "An arm on a leaning floor or a wrongly stated mounting carries its links in another direction.",
    ("payload",),
    "Siciliano et al., Robotics: Modelling, Planning and Control, 2009, section 7.1 (gravity in the base frame)",
    _gravity,
)
SPRING = Kind(
    "joint-spring",
    "Hoses, cables and balancing springs pull a joint back to where they are at rest.",
    ("payload", "gear-ripple"),
    "Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, section 9.3.5 (springs)",
    _spring,
)
LOADS = frozenset(kind.physics for kind in (GRAVITY, ROTOR, SPRING))  # that gear and bearings feel beside a payload
