"""How a laser beam turns or shifts by a law of drivers: about the laser and across the drawn beam."""

import numpy as np

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Inner, Shape, Term
from calibrate.model.effects.time_laws import Law

LIMIT_RAD = 5e-3  # what a mount that is not loose does; diode modules drift by 5 to 50 µrad (makers' data sheets)
LIMIT_M = 1e-3


def beam_axes(drivers: Drivers) -> tuple[Floats, Floats, Floats]:
    """Origin of the beam and two unit vectors across it, in the flange frame, nominal."""
    tool = drivers.rig.tool
    direction = np.array(tool.laser_direction or (0.0, 0.0, 1.0))
    direction = direction / np.linalg.norm(direction)
    u = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    u = np.asarray(u / np.linalg.norm(u), dtype=np.float64)
    v = np.asarray(np.cross(direction, u), dtype=np.float64)
    return np.array(tool.laser_origin_m or (0.0, 0.0, 0.0)), u, v


def of_beam(
    drivers: Drivers,
    physics: str,
    driver: str,
    shape: Shape,
    law: Law,
    inner: tuple[Inner, ...] = (),
    open_family: bool = False,
) -> tuple[Term, Term]:
    """The beam turns with `law` (pose, 1) of the driver; it shifts across itself, its direction kept."""
    origin, u, v = beam_axes(drivers)
    turns = np.stack([np.concatenate([np.cross(origin, t), t]) for t in (u, v)], axis=1)
    shifts = np.concatenate([np.stack([u, v], axis=1), np.zeros((3, 2))])
    per = "_per_k" if driver.startswith("temp") else ""

    def form(where: str, verb: str, unit: str, limit: float, directions: Floats) -> Form:
        names = tuple(f"{verb}_{axis}_{unit}{per}" for axis in "uv")
        return Form(
            Port(where, Place.FRAME, drivers.n_joints),
            (driver,),
            shape,
            physics,
            None,
            inner,
            slow=driver == "t",
            open=open_family,
            function=law,
            names=names,
            limit=limit,
            sentence=f"The laser beam {verb}s by {{{names[0]}}} and {{{names[1]}}} across itself"
            + (time_laws.when(inner) if driver == "t" else f" with {driver}"),
            directions=directions,
        )

    turned = form("laser.direction", "turn", "rad", LIMIT_RAD, turns)
    return turned, form("laser.origin", "shift", "m", LIMIT_M, shifts)
