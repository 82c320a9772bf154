"""The whole arm grows: one temperature for all links."""

import numpy as np

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers, beyond_end_m, link_vectors
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.link_thermal_growth import LIMIT_GROWTH, LIMIT_PER_K
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Inner, Shape, Term
from calibrate.model.effects.time_laws import Law, varies


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out = [
        _term(drivers, f"temp_{where}", Shape.LINEAR, _warmed(where), (), "expansion_per_k", LIMIT_PER_K)
        for where, T in drivers.temperatures_degC.items()
        if varies(T)
    ]
    inner = time_laws.constant_inner(drivers)
    out.append(_term(drivers, "t", Shape.EXPONENTIAL, time_laws.towards, inner, "growth_share", LIMIT_GROWTH))
    return tuple(out)


def _warmed(where: str) -> Law:
    return lambda drivers, inner: time_laws.with_temperature(where, drivers, inner)


def _longest(drivers: Drivers) -> int:
    """Number of the longest link: the one that grows most."""
    lengths = [np.linalg.norm(link_vectors(drivers, link)[0]) for link in range(1, drivers.n_joints + 1)]
    return 1 + int(np.argmax(lengths))


def _term(
    drivers: Drivers, driver: str, shape: Shape, law: Law, inner: tuple[Inner, ...], name: str, limit: float
) -> Term:
    """All link vectors by the same share: the flange moves along its vector from the base."""

    def function(drivers: Drivers, values: Floats) -> Floats:
        flange = drivers.frames[:, -1]
        start = drivers.frames[:, 0, :3, 3] - beyond_end_m(drivers, 0) * drivers.frames[:, 0, :3, 2]
        reach = flange[:, :3, 3] - start
        out = np.zeros((len(reach), 6, 1))
        out[:, :3, 0] = law(drivers, values) * np.einsum("nji,nj->ni", flange[:, :3, :3], reach)
        return out

    return Form(
        Port(f"link{_longest(drivers)}.length", Place.FRAME, drivers.n_joints),
        (driver,),
        shape,
        "link-thermal-growth",
        None,
        inner,
        slow=driver == "t",
        variant="whole arm",
        function=function,
        names=(name,),
        limit=limit,
        sentence=f"The whole arm grows by {{{name}}}{time_laws.when(inner)}, most of all its longest link, "
        f"{_longest(drivers)}: heat",
    )


EFFECT = Kind(
    "link-thermal-growth",
    "A room or an enclosure warms all links alike, and every length of the arm grows by the same share.",
    ("base-moved", "device-scale", "device-drift"),
    "6 to 24e-6 per K, steel to aluminium: ISO/TR 16015:2003, annex",
    _terms,
)
