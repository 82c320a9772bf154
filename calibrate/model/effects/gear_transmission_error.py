"""Gear mesh: an error once or twice a motor turn."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import (
    Form,
    Inner,
    Missing,
    Shape,
    Term,
    at_joint,
)

Floats = NDArray[np.float64]
MULTIPLES = (1.0, 2.0)  # of the ratio: runout of the pinion, the two lobes of a wave generator
AROUND = 0.02  # of the ratio as stated
LIMIT_RAD = 2e-3
FINEST = 400  # grid points: phase over the range of the joint is resolved to a quarter turn


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for joint, link in enumerate(drivers.rig.arm.joints, start=1):
        if link.gear_ratio is not None:
            out += [_term(drivers, joint, link.gear_ratio * multiple) for multiple in MULTIPLES]
    return tuple(out)


def _term(drivers: Drivers, joint: int, order: float) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)
    reach = max(float(np.ptp(drivers.q_rad[:, joint - 1])), 0.1)
    points = int(np.clip(2.0 * AROUND * order * reach / (np.pi / 2.0), 3, FINEST)) | 1
    grid = order * np.linspace(1.0 - AROUND, 1.0 + AROUND, points)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        angle = inner[0] * drivers.q_rad[:, joint - 1]
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)

    return Form(
        port,
        (f"q{joint}",),
        Shape.HARMONIC,
        "gear-transmission-error",
        round(order),
        (Inner("order_per_turn", tuple(grid.tolist()), float(grid[0]), float(grid[-1])),),
        function=function,
        names=("amplitude_rad", "phase_rad"),
        limit=LIMIT_RAD,
        sentence=f"Joint {joint} is off by up to {{amplitude_rad}} at the order of its gear mesh ({{order_per_turn}})",
        directions=direction,
        polar=True,
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    if any(link.gear_ratio is not None for link in drivers.rig.arm.joints):
        return ()
    return (Missing("q", "arm.joint.gear_ratio in the rig", "gear-transmission-error"),)


EFFECT = Kind(
    "gear-transmission-error",
    "A pinion or wave generator that runs out of true moves the joint back and forth with every motor turn.",
    ("encoder-harmonic", "unknown"),
    "Tuttle, Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics Autom. 12(3), 1996",
    _terms,
    _missing,
)
