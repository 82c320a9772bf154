"""What may have changed since a model was made: constants of geometry, which only a recording of later can show.

They are candidates beside the catalogue where a model is known with its covariance: within one recording a constant is
geometry, and nothing could tell it from that.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Form, at_joint
from calibrate.effects.moved import SIX, in_use, motion
from calibrate.effects.ports import Place, Port
from calibrate.effects.term import Shape, Term
from calibrate.effects.time_laws import Law
from calibrate.sensors import seat, spots

Floats = NDArray[np.float64]

RECORDING = "recording"  # the driver: one value a recording
LIMIT_RAD, LIMIT_M = 5e-2, 2e-2  # beyond, something was put together anew


def changes(drivers: Drivers) -> tuple[Term, ...]:
    """Zeros, links, tool, and whatever stands around the arm."""
    joints, standing = range(1, drivers.n_joints + 1), tuple(_standing(drivers))
    links = (term for i in joints for term in _link(drivers, i))
    return (*(_zero(i, drivers.n_joints) for i in joints), *links, *_tool(drivers), *standing)


def _constant(port: Port, physics: str, names: tuple[str, ...], columns: Floats, sentence: str) -> Form:
    """`columns` (width, m) of the port."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        return np.broadcast_to(columns, (len(drivers.q_rad), *columns.shape)).copy()

    limit = max(LIMIT_RAD if name.endswith("_rad") else LIMIT_M for name in names)
    return Form(
        port,
        (RECORDING,),
        Shape.CONSTANT,
        physics,
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
    Hartenberg count them, the last one after Hayati.
    """
    before, behind = drivers.frames[0, i - 1], drivers.frames[0, i]
    along = behind[:3, :3].T @ before[:3, 2]
    for what, name, twist in (
        ("length", "length_m", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("offset", "offset_m", [*along.tolist(), 0.0, 0.0, 0.0]),
        ("twist", "twist_rad", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        ("tilt", "tilt_rad", [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    ):
        port = Port(f"link{i}.{what}", Place.FRAME, i)
        sentence = f"Link {i} changed: {what} by {{{name}}}"
        yield _constant(port, "link-changed", (name,), np.array(twist)[:, None], sentence)


def _tool(drivers: Drivers) -> Iterator[Form]:
    """The target or probe; of a laser also where it points."""
    port, laser = Port("tool.point", Place.FRAME, drivers.n_joints), spots.KIND.name in drivers.readouts
    told = ", ".join(f"{{{name}}}" for name in SIX[:3])
    if set(drivers.readouts) - {spots.KIND.name}:
        yield _constant(
            port, "tool-moved", SIX[:3], np.eye(6)[:, :3], f"The tool moved by {told} in x, y, z of the flange"
        )
    if laser:
        turned = ", ".join(f"{{{name}}}" for name in SIX[3:])
        port = Port("laser.direction", Place.FRAME, drivers.n_joints)
        sentence = f"The laser moved by {told} and turned by {turned} in x, y, z of the flange"
        yield _constant(port, "laser-moved", SIX, np.eye(6), sentence)


def _standing(drivers: Drivers) -> Iterator[Term]:
    """Base, each station of the fixture, each cone."""

    def whole(drivers: Drivers, inner: Floats) -> Floats:
        return np.ones((len(drivers.q_rad), 1))

    yield motion("base.pose", "base-moved", RECORDING, Shape.CONSTANT, whole, "The base", told=False)
    for kind, where, physics, width, what, one in (
        (spots.KIND, "fixture.pose", "fixture-moved", 6, "The fixture at station", "place"),
        (seat.KIND, "seat.position", "seat-moved", 3, "Seat", seat.POINTS),
    ):
        readout = drivers.readouts.get(kind.name)
        if readout is None or readout.place is None:
            continue
        for place in np.unique(readout.place[readout.seen]).tolist():
            there: Law = in_use(readout.seen & (readout.place == place))
            variant = f"{one} {place}"
            what_moved = f"{what} {place}"
            yield motion(
                where, physics, RECORDING, Shape.CONSTANT, whole, what_moved, (), there, width, variant, told=False
            )
