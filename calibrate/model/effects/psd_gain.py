"""A detector's scale, its two axes apart, and their crosstalk."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.psd_terms import of_both, readout
from calibrate.model.effects.term import Floats, Shape, Term

LIMIT = 0.1


def _one(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    return spot[:, :, None]


def _two(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    out = np.zeros((len(spot), 2, 2))
    out[:, 0, 0], out[:, 1, 1] = spot.T
    return out


def _skew(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    """Axes that are not square, half of it seen from either: the other half turns the detector, which geometry does."""
    return spot[:, ::-1, None] / 2.0


def _cross(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    return np.concatenate([_two(drivers, detector, spot), _skew(drivers, detector, spot)], axis=2)


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    forms = (
        ("", _one, ("gain_error_share",), "PSD {k} reads {{gain_error_share}} too far out"),
        (
            "each axis",
            _two,
            ("gain_x_error_share", "gain_y_error_share"),
            "PSD {k} reads {{gain_x_error_share}} too far out in x, {{gain_y_error_share}} in y",
        ),
        ("skew", _skew, ("cross_share",), "PSD {k}'s axes are off square by {{cross_share}}: each reads of the other"),
        (
            "each axis and skew",
            _cross,
            ("gain_x_error_share", "gain_y_error_share", "cross_share"),
            "PSD {k} reads {{gain_x_error_share}} too far out in x, {{gain_y_error_share}} in y, and its axes are off "
            "square by {{cross_share}}",
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
    "mismatch catalogue: gain, cross; it has the effect of the robot's scale unless distances between stations are "
    "known",
    _terms,
)
