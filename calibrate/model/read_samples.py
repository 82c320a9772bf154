"""Settled samples of a recording to the observations of a dual-PSD fit."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.model.observations import Observations

Floats = NDArray[np.float64]
Angles = Literal["reported", "encoders"]

SIGMA_COLUMNS = ("psd1_x_sigma_m", "psd1_y_sigma_m", "psd2_x_sigma_m", "psd2_y_sigma_m")


def observations(samples: Samples, angles: Angles = "reported") -> Observations:
    """The rows in which both spots were seen, with the angles that the controller reported or the second encoders.

    DataError where columns are missing, or a row that has spots has no angles, placement or order.
    """
    spots = samples.spots()
    if spots is None:
        raise DataError("samples: no columns psd1_x_m, psd1_y_m, psd2_x_m, psd2_y_m; this is no dual-PSD recording")
    rows = np.flatnonzero(np.all(np.isfinite(spots), axis=1))
    if len(rows) == 0:
        raise DataError(f"samples: none of {len(spots)} rows has all four spot coordinates; nothing to fit")
    q_rad = samples.joints() if angles == "reported" else samples.encoders()
    if q_rad is None:
        raise DataError("samples: no columns enc1_rad ...; fit the reported angles instead")
    _refuse_missing(q_rad, rows, "joint angles")
    for name in ("placement", "first_psd"):
        if name not in samples:
            raise DataError(f"samples: no column {name}; every dual-PSD row needs it")
        _refuse_missing(samples.column(name)[:, None], rows, name)
    return Observations(
        q_rad[rows],
        samples.integers("first_psd", 0)[rows],
        samples.integers("placement", 0)[rows],
        spots[rows],
        _sigma(samples, rows),
        samples.integers("repeat", -1)[rows] if "repeat" in samples else None,
    )


def _refuse_missing(values: Floats, rows: NDArray[np.intp], what: str) -> None:
    bad = rows[~np.all(np.isfinite(values[rows]), axis=1)]
    if len(bad):
        raise DataError(f"samples row {bad[0] + 1}: spots but no {what}; complete the row or remove its spots")


def _sigma(samples: Samples, rows: NDArray[np.intp]) -> Floats | None:
    """(pose, 4) stated sigmas; None unless every row states all of them as positive numbers."""
    if not all(name in samples for name in SIGMA_COLUMNS):
        return None
    sigma = np.stack([samples.column(name) for name in SIGMA_COLUMNS], axis=1)[rows]
    return sigma if bool(np.all(sigma > 0.0)) else None
