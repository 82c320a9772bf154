"""Encoder disc off its axis: the reading runs ahead and behind once a turn."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Form, Shape, Term, at_joint

Floats = NDArray[np.float64]
LIMIT_RAD = 5e-3  # 100 µm on a radius of 20 mm: a disc that was dropped


def once_a_turn(joint: int, drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 2) sine and cosine of the reading."""
    q = drivers.q_rad[:, joint - 1]
    return np.stack([np.sin(q), np.cos(q)], axis=1)


def _off_centre(joint: int, drivers: Drivers, coefficients: Floats) -> Floats:
    """(pose, 1) atan2(-e sin(q - f), 1 + e cos(q - f)) with coefficients (-e cos f, e sin f)."""
    a, b = coefficients
    q = drivers.q_rad[:, joint - 1]
    sine, cosine = np.sin(q), np.cos(q)
    return np.arctan2(a * sine + b * cosine, 1.0 - a * cosine + b * sine)[:, None]


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        port, direction = at_joint(joint, drivers.n_joints)

        def function(drivers: Drivers, inner: Floats, joint: int = joint) -> Floats:
            return once_a_turn(joint, drivers, inner)

        def exact(drivers: Drivers, coefficients: Floats, inner: Floats, joint: int = joint) -> Floats:
            return _off_centre(joint, drivers, coefficients)

        out.append(
            Form(
                port,
                (f"q{joint}",),
                Shape.HARMONIC,
                "encoder-eccentricity",
                1,
                function=function,
                names=("amplitude_rad", "phase_rad"),
                limit=LIMIT_RAD,
                sentence=f"Joint {joint} reads off by up to {{amplitude_rad}} once a turn: encoder disc off centre",
                directions=direction,
                polar=True,
                exact=exact,
            )
        )
    return tuple(out)


EFFECT = Kind(
    "encoder-eccentricity",
    "The disc of an encoder sits off its axis, so equal divisions pass the reading head at unequal angles.",
    ("gear-ratio-error", "joint-compliance", "axis-wobble"),
    "error = -atan2(e sin(q - f), 1 + e cos(q - f)), to first order a sin q + b cos q: Sanchez-Brea, Morlanes, "
    "Metrological errors in optical encoders, Meas. Sci. Technol. 19, 2008",
    _terms,
)
