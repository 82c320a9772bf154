"""Poses that could be taken, with what the instrument should read there: rows of a session that was never measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import POSITION, SPOTS, per_joint

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

POSE_S = 8.0  # from one reading to the next: of an emulated session at 1 rad/s; it sets how fast a drift is told to be


@dataclass(frozen=True)
class Candidates:
    """One row a pose. `placement` and `first_psd` are 0 where a position is measured instead of spots."""

    q_rad: Floats  # (pose, joint)
    reading: Floats  # (pose, k) expected: spots (4) or a position (3), m
    placement: Ints  # (pose,)
    first_psd: Ints  # (pose,)

    def __len__(self) -> int:
        return len(self.q_rad)

    @property
    def spots(self) -> bool:
        """Whether the instrument is a dual PSD."""
        return self.reading.shape[1] == len(SPOTS)

    def take(self, rows: NDArray[np.intp]) -> "Candidates":
        """Some of them, in this order."""
        return Candidates(self.q_rad[rows], self.reading[rows], self.placement[rows], self.first_psd[rows])

    def samples(self, approach: Floats | None = None, repeat: Ints | None = None) -> Samples:
        """As a table that a session would leave, read in this order; `approach` (pose, joint), `repeat` (pose,)."""
        n, joints = self.q_rad.shape
        columns = {"t_s": POSE_S * np.arange(n, dtype=np.float64)}
        columns |= dict(zip(per_joint("q", "_rad", joints), self.q_rad.T, strict=True))
        if self.spots:
            columns |= {"placement": self.placement.astype(float), "first_psd": self.first_psd.astype(float)}
        columns |= dict(zip(SPOTS if self.spots else POSITION, self.reading.T, strict=True))
        if approach is not None:
            columns |= dict(zip(per_joint("approach", "", joints), approach.T, strict=True))
        if repeat is not None:
            columns["repeat"] = np.where(repeat > 0, repeat, np.nan)
        return Samples(columns, joints)
