"""What a joint's torque may hold beside rigid links: friction, rotors, loads, springs, drives; one line each."""

from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Term
from calibrate.model.effects.torque import drives, friction, masses_and_springs
from calibrate.model.effects.torque.masses_and_springs import LOADS, PAYLOAD
from calibrate.model.effects.torque.motion_drivers import MotionDrivers, Samples, at_joints, torque_port

TORQUES: tuple[Kind, ...] = (
    friction.COULOMB,
    friction.VISCOUS,
    friction.STRIBECK,
    friction.LOADED,
    friction.COLD,
    friction.RUN_IN,
    masses_and_springs.ROTOR,
    masses_and_springs.PAYLOAD,
    masses_and_springs.GRAVITY,
    masses_and_springs.SPRING,
    drives.CONSTANT,
    drives.OFFSET,
    drives.RIPPLE,
    drives.DELAY,
)


STICTION = friction.STRIBECK.physics


def torque_terms(drivers: MotionDrivers) -> tuple[Term, ...]:
    """Every place and form that the motion allows, and what stands for friction of no catalogue."""
    return (*(term for kind in TORQUES for term in kind.terms(drivers)), *friction.uneven(drivers))


__all__ = [
    "LOADS",
    "PAYLOAD",
    "STICTION",
    "TORQUES",
    "MotionDrivers",
    "Samples",
    "at_joints",
    "torque_port",
    "torque_terms",
]
