"""A link grows with its temperature, or behind it: a casting takes its time to follow the thermometer on its skin."""

import numpy as np

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import SHORTEST_M, Drivers, link_vectors
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import (
    Floats,
    Form,
    Inner,
    Missing,
    Shape,
    Term,
)
from calibrate.model.effects.time_laws import BEHIND, varies

LIMIT_PER_K = 1e-4  # aluminium 24e-6; a thermometer far from the link sees less than the link does
LIMIT_GROWTH = 3e-3  # relative, where time stands for temperature


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for link in range(1, drivers.n_joints + 1):
        if np.linalg.norm(link_vectors(drivers, link)[0]) < SHORTEST_M:
            continue
        for where, T in drivers.temperatures_degC.items():
            if varies(T):
                out += [_with_temperature(link, where), _behind(drivers, link, where)]
        out.append(_over_time(drivers, link))
    return tuple(out)


def _with_temperature(link: int, where: str) -> Term:
    def law(drivers: Drivers, inner: Floats) -> Floats:
        return time_laws.with_temperature(where, drivers, inner)

    return _term(link, f"temp_{where}", Shape.LINEAR, law, (), "expansion_per_k", LIMIT_PER_K)


def _behind(drivers: Drivers, link: int, where: str) -> Term:
    """True of its session only: how warm the casting is depends on what its thermometer has read before."""

    def law(drivers: Drivers, inner: Floats) -> Floats:
        return time_laws.behind_thermometer(where, drivers, inner)

    inner = time_laws.lag_inner(drivers)
    return _term(link, f"temp_{where}", Shape.LINEAR, law, inner, "expansion_per_k", LIMIT_PER_K, BEHIND)


def _over_time(drivers: Drivers, link: int) -> Term:
    inner = time_laws.constant_inner(drivers)
    return _term(link, "t", Shape.EXPONENTIAL, time_laws.towards, inner, "growth_share", LIMIT_GROWTH)


def _term(
    link: int,
    driver: str,
    shape: Shape,
    law: time_laws.Law,
    inner: tuple[Inner, ...],
    name: str,
    limit: float,
    variant: str = "",
) -> Term:
    def function(drivers: Drivers, values: Floats) -> Floats:
        out = np.zeros((len(drivers.t_s), 6, 1))
        out[:, :3, 0] = law(drivers, values) * link_vectors(drivers, link)
        return out

    return Form(
        Port(f"link{link}.length", Place.FRAME, link),
        (driver,),
        shape,
        "link-thermal-growth",
        None,
        inner,
        slow=driver == "t" or variant == BEHIND,
        variant=variant,
        function=function,
        names=(name,),
        limit=limit,
        sentence=f"Link {link} grows by {{{name}}}{time_laws.when(inner)}: heat",
        # What is warmed grows; over time it may cool, too.
        believable=None if driver == "t" else lambda coefficients, inner: bool(coefficients[0] >= 0.0),
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    return () if drivers.temperatures_degC else (Missing("temp", "temp_<where>_degC", "link-thermal-growth"),)


EFFECT = Kind(
    "link-thermal-growth",
    "Motors and the room heat a casting, and it grows by its expansion coefficient.",
    ("base-moved", "device-drift"),
    "6 to 24e-6 per K, steel to aluminium: ISO/TR 16015:2003, annex",
    _terms,
    _missing,
)
