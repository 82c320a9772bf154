"""Light that is not the laser's pulls the spot towards where it falls, the more the weaker the laser is."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.psd_terms import of_both, readout
from calibrate.model.effects.term import Floats, Missing, Shape, Term
from calibrate.model.effects.time_laws import varies

LIMIT = 0.5  # of the light: with more, no detector would be used


def _pull(drivers: Drivers, sum_v: Floats, spot: Floats) -> Floats:
    """(o - x) s0 / sum: two coordinates of the light's centre, and its share."""
    weaker = np.median(drivers.of_session(sum_v)) / np.maximum(sum_v, 1e-9)
    out = np.zeros((len(spot), 2, 3))
    out[:, 0, 0] = out[:, 1, 1] = weaker
    out[:, :, 2] = -spot * weaker[:, None]
    return out


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    total = drivers.psd_sum_v
    if total is None or not varies(total):
        return ()
    return of_both(
        drivers,
        lambda k: readout(
            k,
            "psd-ambient-light",
            Shape.PRODUCT,
            lambda d, detector, spot: _pull(d, total[:, detector - 1], spot),
            ("pull_x_m", "pull_y_m", "ambient_share"),
            LIMIT,
            f"PSD {k} sees {{ambient_share}} of foreign light",
            depends_on=f"psd{k}_sum",
        ),
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    if drivers.light is None or drivers.psd_sum_v is not None:
        return ()
    return (Missing("psd1_sum", "psd1_sum_v, psd2_sum_v", "psd-ambient-light"),)


EFFECT = Kind(
    "psd-ambient-light",
    "A detector reads the centroid of all light; a lamp shifts it by its share of the current.",
    ("psd-gain",),
    "centroid of two sources: x = (x_laser s_laser + x_lamp s_lamp) / sum",
    _terms,
    _missing,
)
