"""Shapes of open families: splines, bumps and waves of unknown place, width and period."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.term import Inner

Floats = NDArray[np.float64]

PIECES = 5  # of a spline: a bump of a fifth of the range is seen
SPLINES = PIECES + 2  # columns
CYCLES = np.arange(1.0, 25.0, 0.25)  # of unknown waves over the range: a quarter apart, phase stays within an eighth
PLACES = 16  # of a bump over the range
WIDTHS = (0.02, 0.05, 0.12)  # of a bump, shares of the range, one sigma; wider ones are seen by splines


def splines(drivers: Drivers, x: Floats) -> Floats:
    """(pose, SPLINES) cubic B-splines over the session's range of x, their sum (a constant) left out."""
    own = drivers.of_session(x)
    low, high = float(own.min()), float(own.max())
    knots = np.concatenate([[low] * 3, np.linspace(low, high, PIECES + 1), [high] * 3])
    return np.asarray(BSpline.design_matrix(np.clip(x, low, high), knots, 3).toarray(), dtype=np.float64)[:, 1:]


def bumps(x: Floats, inner: Floats) -> Floats:
    """(pose, 1) bell curve of height 1 at inner[0], of sigma inner[1]."""
    return np.exp(-0.5 * ((x - inner[0]) / inner[1]) ** 2)[:, None]


def bump_inner(x: Floats) -> tuple[Inner, ...]:
    """Place and width of a bump within the range of x."""
    low, reach = float(x.min()), max(float(np.ptp(x)), 1e-9)
    at = tuple((low + reach * (np.arange(PLACES) + 0.5) / PLACES).tolist())
    wide = tuple(reach * share for share in WIDTHS)
    return (
        Inner("at_rad", at, low, low + reach),
        Inner("width_rad", wide, wide[0] / 2.0, wide[-1] * 1.5),
    )


def periods(x: Floats, name: str) -> Inner:
    """Unknown angular frequency of a wave over x (rad per unit of x)."""
    grid = tuple((2.0 * np.pi * CYCLES / max(float(np.ptp(x)), 1e-9)).tolist())
    return Inner(name, grid, grid[0] * 0.9, grid[-1] * 1.1)


def centred(drivers: Drivers, x: Floats) -> Floats:
    """(pose,) mean 0, rms 1 over the session."""
    own = drivers.of_session(x)
    return (x - own.mean()) / max(float(np.std(own)), 1e-12)
