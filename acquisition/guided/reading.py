"""One accepted reading: where the probe was, and the mean of the encoders while it was held there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.target import Target
from acquisition.recording.samples import Cell

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reading:
    """A row of the samples in the making."""

    target: Target
    q_rad: Floats  # (n,)
    t_s: float  # since the session began, of the encoders' own time
    host_s: float

    def row(self) -> dict[str, Cell]:
        """Column name -> value; names of the session-folder format, version 1."""
        angles = {f"q{i + 1}_rad": float(q) for i, q in enumerate(self.q_rad)}
        return {"t_s": self.t_s, **angles, **self.target.columns}
