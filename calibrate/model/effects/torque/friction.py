"""Friction at a joint, by speed, load, temperature and time since the motion began. Against the motion, in Nm."""

import numpy as np

from calibrate.model.effects.curve import UNKNOWN
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Inner, Missing, Shape, Term
from calibrate.model.effects.torque.motion_drivers import Floats, MotionDrivers, at_joints, joints

LIMIT_NM = 5e3  # the drive of joint 1 of a robot for 300 kg: 300 Nm (Weigand et al., KR 300 R2500)
LIMIT_NMS = 2e4  # Nm per rad/s, of the same
# Speeds of stiction, times that below which a joint is taken to stand: what is slower no torque shows, what reaches a
# fifth of the fastest motion is friction that bends with speed.
STRIBECK_SPEEDS = (0.5, 0.7, 1.4, 2.8, 5.6, 10.0)
RUN_IN_S = (30.0, 100.0, 300.0, 1000.0)  # grease spreads in minutes: in less it is the motion that changes
TURNS = (1, 2, 3)  # waves of uneven friction in a turn of the joint
SPREAD_K = 2.0  # by which a joint must warm up before its friction can be said to follow


def _coulomb(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "coulomb-friction",
        Shape.SIGN,
        ("qd{joint}",),
        lambda d, inner, i: d.sense(i)[:, None],
        ("friction_nm",),
        LIMIT_NM,
        "Joint {joint} needs {friction_nm} more to turn than its model, either way: dry friction",
        reversed_sentence="Joint {joint} needs {friction_nm} less to turn than its model, either way",
    )


def _viscous(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "viscous-friction",
        Shape.LINEAR,
        ("qd{joint}",),
        lambda d, inner, i: d.qd[:, i - 1 : i],
        ("friction_nms_per_rad",),
        LIMIT_NMS,
        "Joint {joint} needs {friction_nms_per_rad} more to turn than its model: viscous friction, grease",
        reversed_sentence="Joint {joint} needs {friction_nms_per_rad} less to turn than its model",
    )


def _stribeck(drivers: Drivers) -> tuple[Term, ...]:
    if not isinstance(drivers, MotionDrivers):
        return ()

    def law(d: MotionDrivers, inner: Floats, i: int) -> Floats:
        return d.sense_by_speed(i, lambda speed: np.exp(-((speed / inner[0]) ** 2)))[:, None]

    def at(i: int) -> tuple[Term, ...]:
        least, *between, most = (share * float(drivers.still_rad_s[i - 1]) for share in STRIBECK_SPEEDS)
        return at_joints(
            drivers,
            "stribeck-friction",
            Shape.EXPONENTIAL,
            ("qd{joint}",),
            law,
            ("friction_nm",),
            LIMIT_NM,
            "Joint {joint} needs {friction_nm} more to turn slowly, below some {speed_rad_s}: stiction",
            among=(i,),
            inner=(Inner("speed_rad_s", tuple(between), least, most),),
            positive=True,
        )

    return tuple(term for i in joints(drivers) for term in at(i))


def _loaded(drivers: Drivers) -> tuple[Term, ...]:
    return at_joints(
        drivers,
        "load-friction",
        Shape.PRODUCT,
        ("qd{joint}", "tau{joint}"),
        lambda d, inner, i: (d.sense(i) * np.abs(d.torque_nm[:, i - 1]))[:, None],
        ("friction_share",),
        1.0,
        "Joint {joint} needs {friction_share} of its load more to turn: friction that grows with load",
        positive=True,
    )


def _cold(drivers: Drivers) -> tuple[Term, ...]:
    if not isinstance(drivers, MotionDrivers) or drivers.temperature_degC is None:
        return ()
    spread_k = np.ptp(_warmth(drivers), axis=0)
    return at_joints(
        drivers,
        "temperature-friction",
        Shape.PRODUCT,
        ("qd{joint}", "temp_joint{joint}"),
        lambda d, inner, i: (d.sense(i) * _warmth(d)[:, i - 1])[:, None],
        ("friction_nm_per_k",),
        LIMIT_NM / 20.0,
        "Joint {joint} needs {friction_nm_per_k} more to turn as it warms up",
        among=[i for i in joints(drivers) if drivers.known or spread_k[i - 1] > SPREAD_K],
        reversed_sentence="Joint {joint} needs {friction_nm_per_k} more to turn the colder it is: bearing or grease",
    )


def _warmth(drivers: MotionDrivers) -> Floats:
    """(moment, joint) K above the reference."""
    heat, reference = drivers.temperature_degC, drivers.reference_degC
    return np.zeros_like(drivers.qd) if heat is None or reference is None else heat - reference


def _run_in(drivers: Drivers) -> tuple[Term, ...]:
    if not isinstance(drivers, MotionDrivers):
        return ()
    length_s = float(np.ptp(drivers.t_s)) if len(drivers.t_s) else 0.0
    grid = tuple(one for one in RUN_IN_S if drivers.known or length_s > 2.0 * one)
    if not grid:
        return ()
    return at_joints(
        drivers,
        "running-in",
        Shape.EXPONENTIAL,
        ("qd{joint}", "t"),
        lambda d, inner, i: (d.sense(i) * np.exp(-(d.t_s - d.begin_s) / inner[0]))[:, None],
        ("friction_nm",),
        LIMIT_NM,
        "Joint {joint} needs {friction_nm} more to turn at first, with a time constant of {time_constant_s}",
        inner=(Inner("time_constant_s", grid, grid[0] / 3.0, 3.0 * grid[-1]),),
        positive=True,
        slow=True,
    )


def uneven(drivers: Drivers) -> tuple[Term, ...]:
    """Open: friction that follows the joint's turn, as no entry of the catalogue does."""

    def law(d: MotionDrivers, inner: Floats, i: int) -> Floats:
        q = d.q_rad[:, i - 1]
        waves = np.stack([np.ones(len(q)), *(wave(k * q) for k in TURNS for wave in (np.sin, np.cos))], axis=1)
        return d.sense(i)[:, None] * waves

    return at_joints(
        drivers,
        UNKNOWN,
        Shape.PRODUCT,
        ("q{joint}", "qd{joint}"),
        law,
        tuple(f"c{k}_nm" for k in range(1 + 2 * len(TURNS))),
        LIMIT_NM,
        "Joint {joint} has friction that changes as it turns",
        variant="uneven friction",
        open_=True,
    )


def _no_temperature(drivers: Drivers) -> tuple[Missing, ...]:
    if isinstance(drivers, MotionDrivers) and drivers.temperature_degC is None:
        return (Missing("temp", "joint_temperature_degC", "temperature-friction"),)
    return ()


COULOMB = Kind(
    "coulomb-friction",
    "Dry contact takes the same torque at any speed, against the motion.",
    ("torque-offset", "load-friction"),
    "Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models for friction, Automatica 30(7), 1994, section 2",
    _coulomb,
)
VISCOUS = Kind(
    "viscous-friction",
    "Grease and oil take a torque that grows with speed.",
    ("coulomb-friction", "torque-delay"),
    "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, section 2",
    _viscous,
)
STRIBECK = Kind(
    "stribeck-friction",
    "Slow joints run on their asperities before a film of grease carries them.",
    ("coulomb-friction",),
    "Stribeck curve: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, section 2.1",
    _stribeck,
)
LOADED = Kind(
    "load-friction",
    "Gear teeth and bearings rub with the load that they carry.",
    ("coulomb-friction", "torque-constant"),
    "Hamon, Gautier, Garrec, Dynamic identification of robots with a dry friction model depending on load "
    "and velocity, IROS 2010",
    _loaded,
)
COLD = Kind(
    "temperature-friction",
    "Grease is stiff while it is cold.",
    ("running-in",),
    "Bittencourt, Gunnarsson, Static friction in a robot joint, J. Dyn. Sys. Meas. Control 134(5), 2012",
    _cold,
    _no_temperature,
)
RUN_IN = Kind(
    "running-in",
    "After a rest grease has to spread before a joint turns lightly.",
    ("temperature-friction",),
    "Carvalho Bittencourt, Axelsson, Modeling and experiment design for identification of wear in a robot joint, 2014",
    _run_in,
)
