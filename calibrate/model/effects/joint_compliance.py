"""Soft joint: gravity torque twists the drive behind the encoder."""

from collections.abc import Sequence

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import loaded, stated_torque_nm, torques_nm
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.loads import Load
from calibrate.model.effects.term import (
    Floats,
    Form,
    Inner,
    Missing,
    Shape,
    Term,
    at_joint,
)
from calibrate.model.effects.weighed import (
    By,
    Weighed,
    by_corrected,
    by_unknown,
    yields,
)

LIMIT_RAD_NM = 1e-3  # fourteen times the softest seen on a small arm (mismatch catalogue: 1 to 70 µrad per Nm)
KNEES = (0.15, 0.3, 0.5, 0.75)  # of the largest torque
LIMIT_RAD = 2e-2  # of the deflection, where masses are not known


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        by = _turned(joint)
        if loaded(drivers, joint):
            out += [_stiff(drivers, joint), _knee(drivers, joint), _stiffening(drivers, joint)]
            corrected = by_corrected(drivers, by)
            out += [_weighed(drivers, joint, corrected)] if corrected is not None else []
        elif (unknown := by_unknown(drivers, by, joint)) is not None:
            out.append(_weighed(drivers, joint, unknown))
    return tuple(out)


def _turned(joint: int) -> By:
    def by(drivers: Drivers, loads: Sequence[Load]) -> Floats:
        return torques_nm(drivers, joint, loads)[:, None, :]

    return by


def _stiff(drivers: Drivers, joint: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        return stated_torque_nm(drivers, joint)[:, None]

    return Form(
        port,
        (f"gravity_torque{joint}",),
        Shape.LINEAR,
        "joint-compliance",
        function=function,
        names=("compliance_rad_nm",),
        limit=LIMIT_RAD_NM,
        sentence=f"Joint {joint} yields {{compliance_rad_nm}}: elastic drive",
        directions=direction,
        believable=lambda coefficients, inner: yields(coefficients),
    )


def _weighed(drivers: Drivers, joint: int, weighed: Weighed) -> Term:
    """One stiffness, under masses that are off by what stated masses are, or that nobody states."""
    port, direction = at_joint(joint, drivers.n_joints)
    stated = f"Joint {joint} yields {{compliance_rad_nm}}: elastic drive; stated masses are off"
    unknown = f"Joint {joint} yields under its load ({{combination1_rad}} rms): elastic drive; masses are not known"
    return Form(
        port,
        (f"gravity_torque{joint}",),
        Shape.LINEAR,
        "joint-compliance",
        variant=weighed.variant,
        function=lambda drivers, inner: weighed.at(drivers)[:, 0],
        names=weighed.names,
        limit=LIMIT_RAD_NM if weighed.stated else LIMIT_RAD,
        sentence=stated if weighed.stated else unknown,
        directions=direction,
        believable=weighed.believable,
    )


def _stiffening(drivers: Drivers, joint: int) -> Term:
    """Stiffer or softer, smoothly, as torque grows."""
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        torque = stated_torque_nm(drivers, joint)
        largest = np.abs(drivers.of_session(torque)).max()
        return np.stack([torque, torque * (torque / largest) ** 2], axis=1)

    return Form(
        port,
        (f"gravity_torque{joint}",),
        Shape.CUBIC,
        "joint-compliance",
        function=function,
        names=("compliance_at_rest_rad_nm", "compliance_change_rad_nm"),
        limit=LIMIT_RAD_NM,
        sentence=f"Joint {joint} yields {{compliance_at_rest_rad_nm}} at no torque and {{compliance_change_rad_nm}} "
        "more at the largest: elastic drive",
        directions=direction,
        # Deflection over torque is c + d x^2 for x in 0 ... 1: a spring gives way along its load.
        believable=lambda coefficients, inner: bool(coefficients[0] >= max(0.0, -coefficients[1])),
    )


def _knee(drivers: Drivers, joint: int) -> Term:
    """Two slopes with a knee: the teeth of a flexspline engage fully above a certain torque (makers' K1, K2, T1)."""
    port, direction = at_joint(joint, drivers.n_joints)
    largest = float(np.abs(stated_torque_nm(drivers, joint)).max())
    knees = tuple(largest * share for share in KNEES)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        torque = stated_torque_nm(drivers, joint)
        below = np.clip(torque, -inner[0], inner[0])
        return np.stack([below, torque - below], axis=1)

    return Form(
        port,
        (f"gravity_torque{joint}",),
        Shape.SMOOTH,
        "joint-compliance",
        None,
        (Inner("knee_nm", knees, knees[0] / 2.0, 0.95 * largest),),
        variant="knee",
        function=function,
        names=("compliance_rad_nm", "compliance_above_rad_nm"),
        limit=LIMIT_RAD_NM,
        sentence=f"Joint {joint} yields {{compliance_rad_nm}} up to {{knee_nm}} and {{compliance_above_rad_nm}} "
        "beyond: two slopes of a harmonic drive",
        directions=direction,
        believable=lambda coefficients, inner: yields(coefficients) and inner[0] < largest,
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    if drivers.rig.tool.mass_kg is not None or any(j.mass_kg is not None for j in drivers.rig.arm.joints):
        return ()
    return (Missing("gravity_torque", "arm.joint.mass_kg and com_m in the rig", "joint-compliance"),)


EFFECT = Kind(
    "joint-compliance",
    "The drive between encoder and link is a spring; the weight it carries turns the joint by torque over stiffness.",
    ("encoder-eccentricity", "payload-compliance", "link-bending"),
    "Nubiola, Bonev, Absolute calibration of an ABB IRB 1600 robot using a laser tracker, Robotics CIM 29(1), 2013",
    _terms,
    _missing,
)
