"""What a dual PSD observed at each settled pose, as plain arrays, read from the samples of a recording."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.errors import DataError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Angles = Literal["reported", "encoders"]
SIGMA_COLUMNS = ("psd1_x_sigma_m", "psd1_y_sigma_m", "psd2_x_sigma_m", "psd2_y_sigma_m")


@dataclass(frozen=True)
class Observations:
    """One row per settled pose. DataError where the shapes disagree or a number is not finite."""

    q_rad: Floats  # (pose, joint) as the controller or the encoders report them
    first_psd: Ints  # (pose,) 1 or 2: the face the beam strikes first
    placement: Ints  # (pose,) id
    spots_m: Floats  # (pose, 4) psd1_x, psd1_y, psd2_x, psd2_y
    sigma_m: Floats | None = None  # (pose, 4) one sigma of the averaged spot, where it was estimated
    repeat: Ints | None = None  # (pose,) rows of one group repeat a pose; -1: no group

    def __post_init__(self) -> None:
        n = len(self.q_rad)
        for name, width in (("first_psd", None), ("placement", None), ("spots_m", 4), ("sigma_m", 4), ("repeat", None)):
            values = getattr(self, name)
            shape = (n,) if width is None else (n, width)
            if values is not None and values.shape != shape:
                raise DataError(f"observations: {name} has shape {values.shape}, expected {shape} for {n} poses")
        for name in ("q_rad", "spots_m", "sigma_m"):
            values = getattr(self, name)
            if values is not None and not np.all(np.isfinite(values)):
                row, column = np.argwhere(~np.isfinite(values))[0]
                raise DataError(
                    f"observations: {name} of pose {row}, column {column} is {values[row, column]}; drop the pose"
                )
        if self.sigma_m is not None and np.any(self.sigma_m <= 0.0):
            raise DataError(f"observations: sigma_m of pose {np.argwhere(self.sigma_m <= 0.0)[0][0]} is not positive")

    def __len__(self) -> int:
        return len(self.q_rad)

    def select(self, rows: NDArray[np.intp]) -> "Observations":
        """Some of the poses."""
        return Observations(
            self.q_rad[rows],
            self.first_psd[rows],
            self.placement[rows],
            self.spots_m[rows],
            None if self.sigma_m is None else self.sigma_m[rows],
            None if self.repeat is None else self.repeat[rows],
        )


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
