"""A detector's scale, its two axes apart, and their crosstalk."""

import numpy as np

from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Floats
from calibrate.effects.kind import Kind
from calibrate.effects.psd_terms import of_both, readout
from calibrate.effects.term import Shape, Term

LIMIT = 0.1


def _one(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    return spot[:, :, None]


def _two(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    out = np.zeros((len(spot), 2, 2))
    out[:, 0, 0], out[:, 1, 1] = spot.T
    return out


def _cross(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    out = np.zeros((len(spot), 2, 4))
    out[:, 0, 0], out[:, 1, 1] = spot.T
    out[:, 0, 2], out[:, 1, 3] = spot[:, 1], spot[:, 0]
    return out


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    forms = (
        ("", _one, ("gain_error_share",), "PSD {k} reads {{gain_error_share}} too far out"),
        (
            "each axis",
            _two,
            ("gain_x_error_share", "gain_y_error_share"),
            "PSD {k} reads {{gain_x_error_share}} too far out in x, {{gain_y_error_share}} in y",
        ),
        (
            "crosstalk",
            _cross,
            ("gain_x_error_share", "gain_y_error_share", "x_from_y_share", "y_from_x_share"),
            "PSD {k} mixes its axes, x from y by {{x_from_y_share}}, y from x by {{y_from_x_share}}, and reads "
            "{{gain_x_error_share}}, {{gain_y_error_share}} too far out",
        ),
    )
    return tuple(
        term
        for variant, columns, names, sentence in forms
        for term in of_both(
            drivers,
            lambda k, variant=variant, columns=columns, names=names, sentence=sentence: readout(
                k, "psd-gain", Shape.LINEAR, columns, names, LIMIT, sentence.format(k=k), variant=variant
            ),
        )
    )


EFFECT = Kind(
    "psd-gain",
    "The length that a detector's electronics divide by is not that of its face.",
    ("psd-nonlinearity", "device-scale"),
    "mismatch catalogue: gain, cross; it looks like the robot's scale unless distances between places are known",
    _terms,
)
