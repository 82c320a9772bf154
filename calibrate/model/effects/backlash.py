"""Slack in a drive: the joint stops on the flank it came from, or on the one that gravity chooses."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import likely_torque_nm, loaded, upright
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import (
    Floats,
    Form,
    Inner,
    Missing,
    Shape,
    Term,
    at_joint,
)
from calibrate.model.effects.time_laws import varies

STRAIGHT = 0.5  # of the largest torque: tanh(2) is 0.96, gentler turns are straight lines to the data
LIMIT_RAD = 5e-3  # 0.3 degrees; worn industrial wrists show 1e-3 (ISO 9283:1998, 7.2.2 tests for it)


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        if drivers.approach is not None and varies(drivers.approach[:, joint - 1]):
            out.append(_by_friction(drivers, joint, drivers.approach))
        torque = likely_torque_nm(drivers, joint)
        if torque.min() < 0.0 < torque.max() and not upright(drivers, joint):
            out.append(_by_gravity(drivers, joint))
    return tuple(out)


def _has_room(coefficients: Floats, inner: Floats) -> bool:
    """Flanks do not overlap: a joint that is ahead of where it came from has no play."""
    return bool(coefficients[0] >= 0.0)


def _by_friction(drivers: Drivers, joint: int, approach: Floats) -> Term:
    """`approach` as recorded: moves are far longer than the play, so its operator stands on the flank it came from."""
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        side = approach if drivers.approach is None else drivers.approach  # of the poses asked for
        return -side[:, joint - 1 : joint] / 2.0

    return Form(
        port,
        (f"approach{joint}",),
        Shape.HYSTERESIS if drivers.approach_derived else Shape.SIGN,
        "backlash",
        function=function,
        names=("play_rad",),
        limit=LIMIT_RAD,
        sentence=f"Joint {joint} stops {{play_rad}} apart, depending on which way it came: slack in the drive",
        directions=direction,
        believable=_has_room,
    )


def _by_gravity(drivers: Drivers, joint: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)
    largest = float(np.abs(likely_torque_nm(drivers, joint)).max())
    unit, name = (1.0, "turning_torque_nm") if loaded(drivers, joint) else (largest, "turning_torque_share")
    grid = tuple(largest / unit * share for share in (0.02, 0.1, 0.3))

    def function(drivers: Drivers, inner: Floats) -> Floats:
        return np.tanh(likely_torque_nm(drivers, joint) / (unit * inner[0]))[:, None] / 2.0

    return Form(
        port,
        (f"gravity_torque{joint}",),
        Shape.SIGN,
        "backlash",
        None,
        (Inner(name, grid, grid[0] / 4.0, grid[-1] * 2.0),),
        function=function,
        names=("play_rad",),
        limit=LIMIT_RAD,
        sentence=f"Joint {joint} hangs {{play_rad}} from flank to flank, by the sign of its load: slack in the drive",
        directions=direction,
        # A flank that the largest load of the session hardly turns over to is no flank: that is a spring.
        believable=lambda coefficients, inner: (
            _has_room(coefficients, inner) and bool(unit * inner[0] < STRAIGHT * largest)
        ),
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    return (Missing("approach", "approach1 ...", "backlash"),) if drivers.approach_derived else ()


EFFECT = Kind(
    "backlash",
    "Between the flanks of a gear there is room; where the joint stands in it depends on friction and load.",
    ("reading-lag", "joint-compliance"),
    "play operator, half width on either side: Visintin, Differential Models of Hysteresis, 1994, ch. III.2",
    _terms,
    _missing,
)
