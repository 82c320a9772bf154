"""Sagging bracket: laser or target hangs differently as the flange turns against gravity."""

import numpy as np
from numpy.typing import ArrayLike

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import gravity_in_flange, turning_joints
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.laser_pointing import beam_axes
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Shape, Term
from calibrate.model.rigid import cross
from calibrate.model.sensors.kind import Trait

LIMIT = 1e-2  # rad, m between upright and level: ten times what a bracket that anyone would measure with may give
SHORTEST_M = 1e-3  # of an overhang that turns anything
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of a symmetric matrix


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    driver, tool = turning_joints(drivers), drivers.rig.tool
    if not driver:
        return ()
    out: list[Term] = []
    if drivers.light is not None and tool.laser_direction is not None:
        ports = ("laser.direction", "The laser")
        out += _brackets(drivers, *ports, driver, tool.laser_origin_m)
        out += [_towards_gravity(drivers, driver, tool.laser_direction), _tilting(drivers, driver, *ports)]
    if drivers.having(Trait.TARGET):
        ports = ("tool.point", "The target")
        out += [*_brackets(drivers, *ports, driver, tool.point_m), _hanging(drivers, driver), _spring(drivers, driver)]
    return tuple(out)


def _brackets(
    drivers: Drivers, where: str, what: str, driver: str, tip_m: tuple[float, float, float] | None
) -> list[Term]:
    """One for the overhang of the tip, one for that of the tool's centre of mass."""
    overhangs = {"to its tip": tip_m, "to its centre of mass": drivers.rig.tool.com_m}
    return [
        _bracket(drivers, where, what, driver, np.array(at), words)
        for words, at in overhangs.items()
        if at is not None and np.linalg.norm(at) >= SHORTEST_M
    ]


def _bracket(drivers: Drivers, where: str, what: str, driver: str, overhang_m: Floats, words: str) -> Term:
    """The flange end turns by C (r x g): a cantilever of overhang r, as stiff in all directions."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        out = np.zeros((len(drivers.t_s), 6, 1))
        out[:, 3:, 0] = cross(overhang_m[None] / np.linalg.norm(overhang_m), gravity_in_flange(drivers))
        return out

    return Form(
        Port(where, Place.FRAME, drivers.n_joints),
        (driver,),
        Shape.LINEAR,
        "tool-sag",
        variant=f"bracket, overhang {words}",
        function=function,
        names=("sag_rad",),
        limit=LIMIT,
        sentence=f"{what}'s bracket gives way by {{sag_rad}} when its overhang {words} lies level: soft bracket",
    )


def _towards_gravity(drivers: Drivers, driver: str, along: ArrayLike) -> Term:
    """The beam leans towards gravity by gravity's component across the beam: a laser that hangs by its end."""
    direction = np.array(along) / np.linalg.norm(along)
    origin = np.array(drivers.rig.tool.laser_origin_m or (0.0, 0.0, 0.0))

    def function(drivers: Drivers, inner: Floats) -> Floats:
        turn = np.cross(direction, gravity_in_flange(drivers))
        return np.concatenate([np.cross(origin, turn), turn], axis=1)[:, :, None]  # about the laser

    return Form(
        Port("laser.direction", Place.FRAME, drivers.n_joints),
        (driver,),
        Shape.LINEAR,
        "tool-sag",
        variant="towards gravity",
        function=function,
        names=("sag_rad",),
        limit=LIMIT,
        sentence="The laser leans towards gravity by {sag_rad} when its beam is level: soft mount",
    )


def _tilting(drivers: Drivers, driver: str, where: str, what: str) -> Term:
    """Two tilts of the beam, each by every component of gravity: a mount of any shape."""
    origin, u, v = beam_axes(drivers)
    turns = np.stack([np.concatenate([np.cross(origin, axis), axis]) for axis in (u, v)], axis=1)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        g = gravity_in_flange(drivers)
        return np.einsum("na,wt->nwta", g, turns).reshape(len(g), 6, 6)

    return Form(
        Port(where, Place.FRAME, drivers.n_joints),
        (driver,),
        Shape.LINEAR,
        "tool-sag",
        variant="mount of any shape",
        function=function,
        names=tuple(f"sag_{tilt}_by_g{a}_rad" for tilt in "uv" for a in "xyz"),
        limit=LIMIT,
        sentence=f"{what} tilts with gravity, by {{sag_u_by_gx_rad}}, {{sag_u_by_gy_rad}}, {{sag_u_by_gz_rad}} one "
        "way, {sag_v_by_gx_rad}, {sag_v_by_gy_rad}, {sag_v_by_gz_rad} the other way: soft mount",
    )


def _hanging(drivers: Drivers, driver: str) -> Term:
    """The target shifts with gravity, as a spring of equal stiffness in every direction."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        g = gravity_in_flange(drivers)
        return np.pad(g, ((0, 0), (0, 3)))[:, :, None]

    return Form(
        Port("tool.point", Place.FRAME, drivers.n_joints),
        (driver,),
        Shape.LINEAR,
        "tool-sag",
        variant="hanging",
        function=function,
        names=("sag_m",),
        limit=LIMIT,
        sentence="The target hangs {sag_m} lower whichever way the flange is turned: soft bracket",
    )


def _spring(drivers: Drivers, driver: str) -> Term:
    """The target shifts by a symmetric matrix times gravity: elastic, of any shape (Maxwell-Betti reciprocity)."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        g = gravity_in_flange(drivers)
        out = np.zeros((len(g), 6, len(PAIRS)))
        for k, (i, j) in enumerate(PAIRS):
            out[:, i, k] += g[:, j]
            if i != j:
                out[:, j, k] += g[:, i]
        return out

    names = tuple(f"sag_{'xyz'[i]}{'xyz'[j]}_m" for i, j in PAIRS)
    return Form(
        Port("tool.point", Place.FRAME, drivers.n_joints),
        (driver,),
        Shape.LINEAR,
        "tool-sag",
        variant="bracket of any shape",
        function=function,
        names=names,
        limit=LIMIT,
        sentence="The target's bracket gives way by {sag_xx_m}, {sag_yy_m}, {sag_zz_m} under gravity along x, y, z "
        "of the flange, and across by {sag_xy_m}, {sag_xz_m}, {sag_yz_m}: soft bracket",
    )


EFFECT = Kind(
    "tool-sag",
    "A bracket is a cantilever; turned against gravity, it bends the other way.",
    ("joint-compliance", "link-bending"),
    "end slope of a cantilever, moment r x m g over stiffness: Young, Budynas, Roark's Formulas, 7th ed., table 8.1; "
    "symmetric compliance: Maxwell-Betti reciprocity",
    _terms,
)
