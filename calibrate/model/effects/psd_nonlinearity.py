"""Pincushion and other bending of a detector's scale."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.psd_terms import half_size_m, of_both, readout
from calibrate.model.effects.term import Floats, Shape, Term

LIMIT = 0.2  # of the spot, at the edge


def _radial(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    square = np.sum(spot**2, axis=1, keepdims=True) / half_size_m(drivers) ** 2
    return (spot * square)[:, :, None]


def _cubic(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    out = np.zeros((len(spot), 2, 2))
    out[:, 0, 0], out[:, 1, 1] = (spot**3 / half_size_m(drivers) ** 2).T
    return out


def _quadratic(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    x, y = (spot / half_size_m(drivers)).T
    out = np.zeros((len(spot), 2, 6))
    for i, product in enumerate((x * x, x * y, y * y)):
        out[:, 0, i] = out[:, 1, 3 + i] = product * half_size_m(drivers)
    return out


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    physics = "psd-nonlinearity"
    six = tuple(f"{face}_{square}_share" for face in "xy" for square in ("xx", "xy", "yy"))
    return (
        *of_both(
            drivers,
            lambda k: readout(
                k,
                physics,
                Shape.RADIAL,
                _radial,
                ("edge_share",),
                LIMIT,
                f"PSD {k} stretches its picture by {{edge_share}} at the edge: pincushion",
            ),
        ),
        *of_both(
            drivers,
            lambda k: readout(
                k,
                physics,
                Shape.CUBIC,
                _cubic,
                ("x_share", "y_share"),
                LIMIT,
                f"PSD {k} bends its scale by {{x_share}} in x, {{y_share}} in y at the edge",
            ),
        ),
        *of_both(
            drivers,
            lambda k: readout(
                k,
                physics,
                Shape.QUADRATIC,
                _quadratic,
                six,
                LIMIT,
                f"PSD {k} bends its axes: x by {{x_xx_share}} at the edge",
            ),
        ),
    )


EFFECT = Kind(
    "psd-nonlinearity",
    "Current does not divide evenly near the edge of a resistive layer, so spots seem farther out or closer in.",
    ("psd-gain",),
    "tetra- and duo-lateral position non-linearity: Makynen, Position-sensitive devices and sensor systems, Oulu, 2000",
    _terms,
)
