"""What was observed at each settled pose of a dual-PSD session, as plain arrays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
