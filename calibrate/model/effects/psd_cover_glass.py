"""A cover glass shifts a slanting beam sideways."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.psd_terms import of_both, readout
from calibrate.model.effects.term import Floats, Shape, Term
from calibrate.model.sensors import spots

INDEX = 1.517  # N-BK7 at 633 nm (Schott data sheet)
LIMIT_M = 5e-3  # windows of detectors are 0.3 to 2 mm thick


def _shift(drivers: Drivers, detector: int, spot: Floats) -> Floats:
    """A plate of thickness t lands the beam t (tan r - tan i) short, along its lean."""
    lean = drivers.readouts[spots.KIND.name].lean
    slope = np.zeros_like(spot) if lean is None else lean[:, detector - 1]
    tangent = np.linalg.norm(slope, axis=1, keepdims=True)
    sine = tangent / np.sqrt(1.0 + tangent**2) / INDEX
    inside = sine / np.sqrt(1.0 - sine**2)
    direction = slope / np.maximum(tangent, 1e-12)
    return ((inside - tangent) * direction)[:, :, None]


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    return of_both(
        drivers,
        lambda k: readout(
            k,
            "psd-cover-glass",
            Shape.SMOOTH,
            _shift,
            ("thickness_m",),
            LIMIT_M,
            f"PSD {k} lies behind {{thickness_m}} of glass",
            depends_on=f"incidence{k}",
        ),
    )


EFFECT = Kind(
    "psd-cover-glass",
    "A slanting beam is refracted in the window and meets the face a little short.",
    ("psd-gain",),
    "Snell's law; t (tan i - tan r), mismatch catalogue; index of N-BK7 from Schott's data sheet",
    _terms,
)
