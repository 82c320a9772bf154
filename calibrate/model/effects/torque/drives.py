"""What a drive adds to the torque that it states: scale, offset, ripple of its gear, delay."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import RECORDING
from calibrate.model.effects.term import Shape, Term
from calibrate.model.effects.torque.motion_drivers import Floats, Law, MotionDrivers, at_joints, joints

LIMIT_NM = 5e3
MOST_DELAY_S = 0.05
MOTOR_ORDERS = (1, 2)  # of the motor's turn: an eccentric gear wheel, the two lobes of a wave generator
LEAST_ON_A_WAVE = 4.0  # samples on a wave: faster, and they do not show it
LEAST_TURN = 0.5  # of a joint's wave, that the motion must hold
LEAST_PASSED = 0.05  # of its squares, that the low pass leaves


def _constant(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "torque-constant",
        Shape.LINEAR,
        ("tau{joint}",),
        lambda d, inner, i: d.torque_nm[:, i - 1 : i],
        ("scale_share",),
        1.0,
        "The torque of joint {joint} reads {scale_share} more than its links take: torque constant, ratio or masses",
        reversed_sentence="The torque of joint {joint} reads {scale_share} less than its links take",
    )


def _offset(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "torque-offset",
        Shape.CONSTANT,
        (RECORDING,),
        lambda d, inner, i: np.ones((len(d.t_s), 1)),
        ("offset_nm",),
        LIMIT_NM,
        "The torque of joint {joint} is off by {offset_nm}: offset of its current, or friction of unequal senses",
    )


def _ripple(drivers: Drivers) -> tuple[Term, ...]:
    if not isinstance(drivers, MotionDrivers):
        return ()
    ratios = {i: drivers.rig.arm.joints[i - 1].gear_ratio for i in joints(drivers)}
    waves = [(i, order, order * abs(ratio)) for i, ratio in ratios.items() if ratio for order in MOTOR_ORDERS]
    return tuple(
        term
        for i, order, cycles in waves
        if drivers.known or _shows(drivers, i, cycles)
        for term in at_joints(
            drivers,
            "gear-ripple",
            Shape.HARMONIC,
            ("q{joint}",),
            _wave(cycles),
            ("amplitude_nm", "phase_rad"),
            LIMIT_NM,
            f"The torque of joint {{joint}} ripples by {{amplitude_nm}}, {order} times a turn of the motor: gear",
            among=(i,),
            order=order,
            polar=True,
        )
    )


def _shows(drivers: MotionDrivers, i: int, cycles: float) -> bool:
    """Whether samples and low pass leave enough of the waves."""
    angle = drivers.samples.q_rad[:, i - 1] * cycles
    step = float(np.median(np.abs(np.diff(angle)))) if len(angle) > 1 else np.inf
    if float(np.ptp(angle)) < 2.0 * np.pi * LEAST_TURN or step > 2.0 * np.pi / LEAST_ON_A_WAVE:
        return False
    return float(np.mean(np.sum(_wave(cycles)(drivers, np.zeros(0), i) ** 2, axis=1))) > LEAST_PASSED


def _wave(cycles: float) -> Law:
    def law(d: MotionDrivers, inner: Floats, i: int) -> Floats:
        angle = cycles * d.samples.q_rad[:, i - 1]
        return d.samples.passed(np.stack([np.sin(angle), np.cos(angle)], axis=1))

    return law


def _delay(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "torque-delay",
        Shape.LINEAR,
        ("dtau{joint}",),
        lambda d, inner, i: -d.torque_rate_nm_s[:, i - 1 : i],
        ("delay_s",),
        MOST_DELAY_S,
        "The torque of joint {joint} is stamped {delay_s} later than its motion",
        reversed_sentence="The torque of joint {joint} is stamped {delay_s} earlier than its motion",
    )


CONSTANT = Kind(
    "torque-constant",
    "Torque is current times a constant, which magnets lose with heat and age, times the ratio of the gear.",
    ("payload", "load-friction"),
    "Gautier, Briot, Global identification of joint drive gains and dynamic parameters of robots, J. Dyn. Sys. Meas. "
    "Control 136(5), 2014",
    _constant,
)
OFFSET = Kind(
    "torque-offset",
    "An amplifier's offset, or friction that is greater one way, adds the same torque at any speed.",
    ("coulomb-friction", "joint-spring"),
    "Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, section 12.4 (offsets of the currents)",
    _offset,
)
RIPPLE = Kind(
    "gear-ripple",
    "Teeth, an eccentric wheel or the lobes of a wave generator make the torque rise and fall with the motor's turn.",
    ("joint-spring",),
    "Tuttle, Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics Autom. 12(3), 1996",
    _ripple,
)
DELAY = Kind(
    "torque-delay",
    "Torque and angle of one row were not taken at one moment.",
    ("viscous-friction", "rotor-inertia"),
    "first order of torque(t - delay)",
    _delay,
)
