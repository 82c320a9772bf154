"""Rows of one cone bring the tip to one point, whatever the side from which the probe leans."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.least_distance import weights
from calibrate.blunders.witness import Otherwise, Strain

Floats = NDArray[np.float64]

FEWEST_ROWS = 12  # in seats of several rows; each seat takes three unknowns, the target three
TURNS = 25
DAMPING = 1e-6  # of the mean square of a column: where the probe leans one way the target stays as drawn


@dataclass(frozen=True)
class SeatWitness:
    """Seats and target are found; a drawn target should not have to move. An arm that hardly moves satisfies them."""

    q_rad: Floats  # (row, joint)
    seat: NDArray[np.int64]  # (row,) every seat has several rows
    point_m: Floats | None  # (3,) target as drawn in the flange frame

    def strain(self, T_base_flange: Floats) -> Strain:
        """Target by linear least squares with every seat at the weighted mean of its tips."""
        R, t = T_base_flange[:, :3, :3], T_base_flange[:, :3, 3]
        drawn = np.zeros(3) if self.point_m is None else self.point_m
        _, of_seat = np.unique(self.seat, return_inverse=True)
        member = (of_seat == np.arange(of_seat.max() + 1)[:, None]).astype(float)  # (seat, row)
        weight, shift, distance = np.ones(len(t)), np.zeros(3), np.zeros(len(t))
        for _ in range(TURNS):
            share = member * weight
            share /= share.sum(axis=1, keepdims=True)
            turns = R - np.tensordot(share, R, axes=1)[of_seat]
            away = R @ drawn + t
            away = away - (share @ away)[of_seat]
            normal = np.einsum("n,nki,nkj->ij", weight, turns, turns)
            normal += DAMPING * (np.trace(normal) / 3.0 + 1e-300) * np.eye(3)
            shift = -np.linalg.solve(normal, np.einsum("n,nki,nk->i", weight, turns, away))
            distance = np.linalg.norm(away + turns @ shift, axis=1)
            weight = weights(distance)
        return Strain(float(np.median(distance)), 0.0 if self.point_m is None else float(np.linalg.norm(shift)))

    def otherwise(self) -> Iterator[Otherwise]:
        """A cone has no reading that could be written otherwise."""
        yield from ()
