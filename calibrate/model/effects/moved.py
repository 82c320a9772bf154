"""Something that should stand has moved: the six-component laws that base, fixture, device and seat share."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.form import Floats, Form
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Inner, Shape, Term
from calibrate.model.effects.time_laws import FOR_A_WHILE, Law, varies

SIX = ("shift_x_m", "shift_y_m", "shift_z_m", "turn_x_rad", "turn_y_rad", "turn_z_rad")
LIMIT = 2e-2  # m, rad: farther, and it was put somewhere else


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
