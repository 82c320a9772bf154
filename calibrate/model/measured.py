"""One instrument's rows as they were measured: its chain, what was read, and what is assumed of its noise.

Noise of a row is joint repeatability mapped through the arm, G G' joint^2 with G the derivative by the readings, plus
the instrument's own. How sizes of noise are found and rows weighted is a matter of the fit (fit/weighting.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.model.problem import Problem

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Measured:
    """One instrument's rows. `problem` need not be weighted yet."""

    name: str  # "position", "dual-psd", ...
    problem: Problem
    own_sigma: Mapping[str, Floats]  # source -> (row, k) as assumed, zero where the source does not reach
    sample_rows: Indices  # (row, 1) or (row, 2): rows of the table of samples that each row was made of
    own_correlation: Floats | None = None  # (row,) of pairs: of its own noise with the next row's, if they share a pose

    def parts(self, theta: Floats, joint_rad: float) -> Floats:
        """(1 + source, row, k, k) covariance by joints, then by each own source, at the assumed sizes."""
        by_joint = self.problem.chain.by_joint(theta, self.problem.q_rad)
        each = [parts_of(by_joint, joint_rad, sigma) for sigma in self.own_sigma.values()]
        return np.stack([each[0][0], *(part[1] for part in each)])

    def select(self, rows: Indices) -> "Measured":
        """Some of the rows."""
        own = {source: sigma[rows] for source, sigma in self.own_sigma.items()}
        chained = None if self.own_correlation is None else self.own_correlation[rows]
        return replace(
            self,
            problem=self.problem.select(rows),
            own_sigma=own,
            sample_rows=self.sample_rows[rows],
            own_correlation=chained,
        )

    @property
    def encoder_channels(self) -> Indices | None:
        """(channel,) joints, from 0, that second encoders are read at; None: another instrument."""
        joints = self.problem.chain.sensor.joints_compared()
        return np.array(joints, dtype=np.intp) - 1 if joints else None


def parts_of(by_joint: Floats, joint_rad: float, own_sigma: Floats) -> Floats:
    """(2, row, k, k) covariance by joints, from d reading / d joints, and by the instrument's own sigmas (row, k)."""
    arm = joint_rad**2 * by_joint @ np.swapaxes(by_joint, 1, 2)
    own = np.zeros_like(arm)
    each = range(own_sigma.shape[1])
    own[:, each, each] = own_sigma**2
    return np.stack([arm, own])
