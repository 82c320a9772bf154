"""Something that should stand has moved, within a recording or since a model was made.

Within a recording: the six-component laws that base, fixture, device and seat share. Since a model was made: constants
of geometry, which only a later recording can show. They are candidates beside the catalogue where a model is known with
its covariance: within one recording a constant is geometry, and nothing could separate it from that.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Form, Inner, Shape, Term, at_joint
from calibrate.model.effects.time_laws import FOR_A_WHILE, Law, varies
from calibrate.model.sensors import seat, spots

SIX = ("shift_x_m", "shift_y_m", "shift_z_m", "turn_x_rad", "turn_y_rad", "turn_z_rad")
LIMIT = 2e-2  # m, rad: farther, and it was put somewhere else
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
AROUND = Place.SURROUNDINGS
RECORDING = "recording"  # the driver: one value a recording
LASER = ("shift_u_m", "shift_v_m", "tilt_u_rad", "tilt_v_rad")  # of calibrate/model/optics/laser.py
SAME = 1.0 - 1e-6  # cosine between two twists (m, rad) that are one
LIMIT_RAD, LIMIT_M = 5e-2, 2e-2  # beyond, something was put together again


def drifts(drivers: Drivers, where: str, physics: str, what: str) -> list[Term]:
    """A pose that creeps towards a new one, steadily, or with any temperature."""
    out = [
        motion(where, physics, "t", Shape.EXPONENTIAL, time_laws.towards, what, time_laws.constant_inner(drivers)),
        motion(where, physics, "t", Shape.LINEAR, time_laws.steadily, what),
    ]
    for place, T in drivers.temperatures_degC.items():
        if varies(T):
            out.append(motion(where, physics, f"temp_{place}", Shape.LINEAR, _warmed(place), what))
    return out


def bumped(
    drivers: Drivers,
    where: str,
    physics: str,
    what: str,
    among: NDArray[np.bool_] | None = None,
    width: int = 6,
    variant: str = "",
) -> list[Term]:
    """A pose that is another one from some moment on, or for a while; `among` (pose,) are samples that can show it."""
    there = None if among is None else in_use(among)
    out: list[Term] = []
    if inner := time_laws.step_inner(drivers, among):
        out.append(motion(where, physics, "t", Shape.STEP, time_laws.step, what, inner, there, width, variant))
    if inner := time_laws.while_inner(drivers, among):
        law, brief = time_laws.for_a_while(among), f"{variant}, {FOR_A_WHILE}".removeprefix(", ")
        out.append(motion(where, physics, "t", Shape.STEP, law, what, inner, there, width, brief))
    return out


def motion(
    where: str,
    physics: str,
    driver: str,
    shape: Shape,
    law: Law,
    what: str,
    inner: tuple[Inner, ...] = (),
    among: Law | None = None,
    width: int = 6,
    variant: str = "",
    open_family: bool = False,
    ending: str = "",
) -> Term:
    """Shift and turn by a law of drivers, about the middle of what the arm reached (turns and shifts stay apart).

    `among` (pose, 1) is one where the thing that moved was in use.
    """
    per = "_per_k" if driver.startswith("temp_") and not open_family else ""
    names = tuple(name + per for name in SIX[:width])
    sizes = [", ".join(f"{{{name}}}" for name in names[k : k + 3]) for k in (0, 3)]

    def function(drivers: Drivers, values: Floats) -> Floats:
        return law(drivers, values) * (1.0 if among is None else among(drivers, values))

    return Form(
        Port(where, Place.SURROUNDINGS),
        (driver,),
        shape,
        physics,
        None,
        inner,
        slow=driver == "t",
        variant=variant,
        open=open_family,
        function=function,
        about=lambda drivers: drivers.about_middle[:, :width],
        names=names,
        limit=LIMIT,
        sentence=f"{what} moved by {sizes[0]} in x, y, z of the base"
        + (f" and turned by {sizes[1]}" if width == 6 else "")
        + (f" with {driver}" if driver != "t" else "")
        + time_laws.when(inner)
        + ending,
    )


def in_use(where: NDArray[np.bool_]) -> Law:
    """(pose, 1) one at these poses."""
    return lambda drivers, inner: where.astype(float)[:, None]


def _warmed(place: str) -> Law:
    return lambda drivers, inner: time_laws.with_temperature(place, drivers, inner)


def changes(drivers: Drivers) -> tuple[Form, ...]:
    """Zeros, links, tool, and whatever stands around the arm."""
    joints, standing = range(1, drivers.n_joints + 1), tuple(_standing(drivers))
    links = (term for i in joints for term in _link(drivers, i))
    return (*(_zero(i, drivers.n_joints) for i in joints), *links, *_tool(drivers), *standing)


def _constant(
    port: Port,
    physics: str,
    names: tuple[str, ...],
    columns: Floats,
    sentence: str,
    among: Flags | None = None,
    variant: str = "",
) -> Form:
    """`columns` (width, m) of the port, at the rows `among` (pose,) or at all."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        rows = np.ones(len(drivers.q_rad)) if among is None else among.astype(np.float64)
        return rows[:, None, None] * columns

    limit = max(LIMIT_RAD if name.endswith("_rad") else LIMIT_M for name in names)
    return Form(
        port,
        (RECORDING,),
        Shape.CONSTANT,
        physics,
        variant=variant,
        function=function,
        names=names,
        limit=limit,
        sentence=sentence,
    )


def _zero(joint: int, n_joints: int) -> Form:
    port, direction = at_joint(joint, n_joints)
    return _constant(
        port, "joint-zero-moved", ("zero_rad",), direction, f"The zero of joint {joint} moved by {{zero_rad}}"
    )


def _link(drivers: Drivers, i: int) -> Iterator[Form]:
    """Along and about the x axis behind joint i, along the axis of the joint, and across both: as Denavit and
    Hartenberg count them, the last one after Hayati. A tilt about the axis of the joint is no candidate: it is the
    zero of the joint under another name.
    """
    before, behind = drivers.frames[0, i - 1], drivers.frames[0, i]
    along = behind[:3, :3].T @ before[:3, 2]
    turn = np.concatenate([np.cross(behind[:3, :3].T @ (before[:3, 3] - behind[:3, 3]), along), along])
    for what, name, twist in (
        ("length", "length_m", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("offset", "offset_m", [*along.tolist(), 0.0, 0.0, 0.0]),
        ("twist", "twist_rad", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        ("tilt", "tilt_rad", [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    ):
        if abs(turn @ twist) > SAME * float(np.linalg.norm(turn)):
            continue
        port = Port(f"link{i}.{what}", Place.FRAME, i)
        sentence = f"Link {i} changed: {what} by {{{name}}}"
        yield _constant(port, "link-changed", (name,), np.array(twist)[:, None], sentence)


def _tool(drivers: Drivers) -> Iterator[Form]:
    """The target or probe; of a laser also where it points."""
    port, laser = Port("tool.point", Place.FRAME, drivers.n_joints), spots.KIND.name in drivers.readouts
    sizes = ", ".join(f"{{{name}}}" for name in SIX[:3])
    if set(drivers.readouts) - {spots.KIND.name}:
        yield _constant(
            port, "tool-moved", SIX[:3], np.eye(6)[:, :3], f"The tool moved by {sizes} in x, y, z of the flange"
        )
    if laser:
        yield _laser(drivers)


def _laser(drivers: Drivers) -> Form:
    return _constant(
        Port("laser.direction", Place.FRAME, drivers.n_joints),
        "laser-moved",
        LASER,
        line_of(drivers),
        "The laser moved by {shift_u_m}, {shift_v_m} and turned by {tilt_u_rad}, {tilt_v_rad} across its beam",
    )


def line_of(drivers: Drivers) -> Floats:
    """(6, 4) twists of the flange by the numbers of LASER, which are those of its line that a model has: nothing shows
    how far it slid along its beam or turned about it, and numbers of which one is invisible are all without a size.
    """
    mount = spots.laser_of(drivers.rig)
    shifts = [np.concatenate([axis, np.zeros(3)]) for axis in (mount.u, mount.v)]
    # A turn about v tilts the beam towards u, one about -u towards v; the origin stays where it is.
    tilts = [np.concatenate([-np.cross(axis, mount.origin_m), axis]) for axis in (mount.v, -mount.u)]
    return np.stack([*shifts, *tilts], axis=1)


def _standing(drivers: Drivers) -> Iterator[Form]:
    """All that stands around the arm, as one body about the middle of what the arm reached; each station of the fixture
    about its own origin, as the rig file has it; each cone.
    """
    shifts, turns = (", ".join(f"{{{name}}}" for name in SIX[k : k + 3]) for k in (0, 3))
    moved = f"moved by {shifts} in x, y, z of the base"
    middle = drivers.frames[:, -1, :3, 3].mean(axis=0)
    both = f"{moved} and turned by {turns}"
    yield _constant(Port("base.pose", AROUND), "base-moved", SIX, _about(middle), f"The base {both}")
    for place, rows in _used(drivers, spots.KIND.name):
        T = spots.fixture_of(drivers.rig).T_base_psd1[place]
        port, what = Port("fixture.pose", AROUND), f"The fixture at station {place}"
        yield _constant(port, "fixture-moved", SIX, _about(T[:3, 3]), f"{what} {both}", rows, f"place {place}")
    for cone, rows in _used(drivers, seat.KIND.name):
        port, variant = Port("seat.position", AROUND), f"{seat.POINTS} {cone}"
        yield _constant(port, "seat-moved", SIX[:3], np.eye(6)[:, :3], f"Seat {cone} {moved}", rows, variant)


def _about(point_m: Floats) -> Floats:
    """(6, 6) base twists of three shifts, and of three turns about a point."""
    columns = np.eye(6)
    columns[:3, 3:] = np.cross(point_m, np.eye(3)).T
    return columns


def _used(drivers: Drivers, instrument: str) -> Iterator[tuple[int, Flags]]:
    """Each station or cone, and the rows (pose,) at which the instrument was there."""
    readout = drivers.readouts.get(instrument)
    if readout is not None and readout.place is not None:
        for place in np.unique(readout.place[readout.seen]).tolist():
            yield place, readout.seen & (readout.place == place)
