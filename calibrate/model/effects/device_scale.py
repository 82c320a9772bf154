"""The device measures in too long or too short a metre, or light bends on its way."""

import numpy as np

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Shape, Term
from calibrate.model.effects.time_laws import varies
from calibrate.model.sensors.kind import Trait

LIMIT = 1e-2  # a draw wire with the wrong drum
LIMIT_PER_K = 5e-5  # a polymer wire; steel 12e-6, air 1e-6


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for name in drivers.having(Trait.DEVICE):
        out += [_scale(name), _power(name, 1, Shape.QUADRATIC), _power(name, 2, Shape.CUBIC)]
        out += [_with_temperature(name, where) for where, T in drivers.temperatures_degC.items() if varies(T)]
    return tuple(out)


def _lengths(drivers: Drivers, name: str) -> Floats:
    """(pose, k) predicted readings, orientation aside."""
    predicted = np.nan_to_num(drivers.readouts[name].predicted).copy()
    predicted[:, 3:] = 0.0
    return predicted


def _scale(name: str) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        return _lengths(drivers, name)[:, :, None]

    return Form(
        Port("device.reading", Place.READING, instrument=name),
        ("reading",),
        Shape.LINEAR,
        "device-scale",
        function=function,
        names=("scale_error_share",),
        limit=LIMIT,
        sentence="The measuring device reads {scale_error_share} too long",
    )


def _power(name: str, power: int, shape: Shape) -> Term:
    """Error along the reading that grows faster than the range: bent light, a sagging wire (w^2 L^3 / 24 T^2)."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        values = _lengths(drivers, name)
        return (values * np.linalg.norm(values, axis=1, keepdims=True) ** power)[:, :, None]

    return Form(
        Port("device.reading", Place.READING, instrument=name),
        ("reading",),
        shape,
        "device-scale",
        function=function,
        names=("scale_change_per_m",) if power == 1 else ("scale_change_per_m_per_m",),
        limit=LIMIT,
        sentence="The measuring device's scale changes with range by {scale_change_per_m}"
        if power == 1
        else "The measuring device's scale changes with the square of range by {scale_change_per_m_per_m}",
    )


def _with_temperature(name: str, where: str) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        return (_lengths(drivers, name) * time_laws.with_temperature(where, drivers, inner))[:, :, None]

    return Form(
        Port("device.reading", Place.READING, instrument=name),
        (f"temp_{where}",),
        Shape.PRODUCT,
        "device-scale",
        function=function,
        names=("scale_share_per_k",),
        limit=LIMIT_PER_K,
        sentence="The measuring device's scale changes by {scale_share_per_k}: air or wire not corrected",
    )


EFFECT = Kind(
    "device-scale",
    "A wrong refractive index, drum diameter or wire tension makes every length too long by the same share.",
    ("device-drift",),
    "refractive index of air, 1e-6 per K: Ciddor, Appl. Optics 35(9), 1996; the arm's own scale has the same effect "
    "unless "
    "its nominal lengths are accurate",
    _terms,
)
