"""Open families at a joint: smooth, periodic, a bump, of two joints, of its load, of time. Where they win, no known
physics is named.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from calibrate.model.effects.curves import (
    bump_inner,
    bumps,
    centred,
    periods,
    splines,
)
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import loaded, stated_torque_nm
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import (
    Floats,
    Form,
    Functions,
    Inner,
    Shape,
    Term,
    at_joint,
)
from calibrate.model.effects.time_laws import varies

LIMIT_RAD = 5e-2  # nobody would call a larger error an unknown effect: a gross error


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    turned = [k for k in range(1, drivers.n_joints + 1) if varies(drivers.q_rad[:, k - 1])]
    pairs = {pair: _of_two(*pair) for pair in combinations(turned, 2)}  # functions once: all joints share their values
    for joint in range(1, drivers.n_joints + 1):
        if joint in turned:
            out += _of_itself(drivers, joint)
        for (a, b), functions in pairs.items():
            names = f"q{a}", f"q{b}"
            for variant, (function, columns) in functions.items():
                out.append(_open(drivers, joint, names, Shape.PRODUCT, function, variant, columns=columns))
        if loaded(drivers, joint):
            out += _of_load(drivers, joint)
        out.append(_open(drivers, joint, ("t",), Shape.SMOOTH, lambda d, inner: splines(d, d.t_s)))
    return tuple(out)


def _of_itself(drivers: Drivers, joint: int) -> list[Term]:
    own, q = (f"q{joint}",), drivers.q_rad[:, joint - 1]

    def smooth(drivers: Drivers, inner: Floats) -> Floats:
        return splines(drivers, drivers.q_rad[:, joint - 1])

    def periodic(drivers: Drivers, inner: Floats) -> Floats:
        angle = inner[0] * drivers.q_rad[:, joint - 1]
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)

    def bump(drivers: Drivers, inner: Floats) -> Floats:
        return bumps(drivers.q_rad[:, joint - 1], inner)

    return [
        _open(drivers, joint, own, Shape.SMOOTH, smooth),
        _open(drivers, joint, own, Shape.HARMONIC, periodic, "period unknown", (periods(q, "order_per_turn"),)),
        _open(drivers, joint, own, Shape.SMOOTH, bump, "bump", bump_inner(q)),
    ]


def _of_two(a: int, b: int) -> Mapping[str, tuple[Functions, int]]:
    """Of each variant the function, and how many columns it has."""

    def sums(drivers: Drivers, inner: Floats) -> Floats:
        x, y = drivers.q_rad[:, a - 1], drivers.q_rad[:, b - 1]
        return _waves(x + y, x - y)

    def double_sums(drivers: Drivers, inner: Floats) -> Floats:
        x, y = drivers.q_rad[:, a - 1], drivers.q_rad[:, b - 1]
        return _waves(x + 2.0 * y, x - 2.0 * y, 2.0 * x + y, 2.0 * x - y)

    def products(drivers: Drivers, inner: Floats) -> Floats:
        x, y = (centred(drivers, drivers.q_rad[:, k - 1]) for k in (a, b))
        return np.stack([x * y, x**2 * y, x * y**2, x**2 * y**2], axis=1)

    return {"sums": (sums, 4), "sums with a double": (double_sums, 8), "products": (products, 4)}


def _of_load(drivers: Drivers, joint: int) -> list[Term]:
    """Any curve of the gravity torque; a spring whose stiffness changes as the joint turns, up to four times a turn:
    planets of a stage take the load one after the other, and three or four are usual. With fewer waves such a spring
    is taken for an even one and errors of the encoder.
    """

    def smooth(drivers: Drivers, inner: Floats) -> Floats:
        return splines(drivers, stated_torque_nm(drivers, joint))

    def uneven(drivers: Drivers, inner: Floats) -> Floats:
        torque, q = stated_torque_nm(drivers, joint), drivers.q_rad[:, joint - 1]
        share = torque / max(float(np.abs(drivers.of_session(torque)).max()), 1e-12)
        return share[:, None] * np.concatenate([np.ones((len(q), 1)), _waves(q, 2.0 * q, 3.0 * q, 4.0 * q)], axis=1)

    torque = f"gravity_torque{joint}"
    return [
        _open(drivers, joint, (torque,), Shape.SMOOTH, smooth),
        _open(drivers, joint, (torque, f"q{joint}"), Shape.PRODUCT, uneven, "uneven spring"),
    ]


def _open(
    drivers: Drivers,
    joint: int,
    names: tuple[str, ...],
    shape: Shape,
    function: Functions,
    variant: str = "",
    inner: tuple[Inner, ...] = (),
    columns: int | None = None,
) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)
    count = columns or function(drivers, np.array([spec.grid[0] for spec in inner])).shape[1]
    return Form(
        port,
        names,
        shape,
        "unknown",
        None,
        inner,
        variant=variant,
        slow=names == ("t",),
        open=True,
        function=function,
        names=tuple(f"c{k}_rad" for k in range(1, count + 1)),
        limit=LIMIT_RAD,
        sentence=f"Joint {joint} is off by an unknown function of {', '.join(names)}",
        directions=direction,
    )


def _waves(*angles: Floats) -> Floats:
    """(pose, 2 for each angle) sines and cosines."""
    return np.stack([wave(angle) for angle in angles for wave in (np.sin, np.cos)], axis=1)


EFFECT = Kind(
    "unknown",
    "Something at a joint that no entry of this catalogue describes.",
    (),
    "open families of mismatch lesson 6: f(qa +- qb), spline f(q), products, periodic of unknown period",
    _terms,
)
