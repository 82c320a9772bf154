"""The point nearest to several laser lines, with its derivative."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CENTRED_M = 1e-4  # a spot farther off moves the line by more than the tolerance of a 5 µm centring can explain


@dataclass(frozen=True)
class Lines:
    """Laser lines in the base frame and how they move with the parameters."""

    point_m: Floats  # (line, 3)
    direction: Floats  # (line, 3) unit
    point_by: Floats  # (line, 3, param) derivative of the point
    direction_by: Floats  # (line, 3, param) derivative of the direction, across it

    def select(self, rows: list[int]) -> "Lines":
        """Some of the lines."""
        return Lines(self.point_m[rows], self.direction[rows], self.point_by[rows], self.direction_by[rows])


def nearest_point(lines: Lines) -> tuple[Floats, Floats]:
    """Point (3,) with the least sum of squared distances to the lines, and its derivative (3, param).

    c = (sum P_k)^-1 sum P_k p_k with P_k = 1 - d_k d_k'; of two lines it is the middle of their common perpendicular.
    LinAlgError where all lines are parallel. Source: normal equations of sum |P_k (c - p_k)|^2.
    """
    across = _across(lines.direction)
    normal = across.sum(axis=0)
    point = np.linalg.solve(normal, np.einsum("kij,kj->i", across, lines.point_m))
    moved = np.einsum("kij,kjm->im", across, lines.point_by) - _turned(lines, point).sum(axis=0)
    return point, np.linalg.solve(normal, moved)


def distances(lines: Lines) -> tuple[Floats, Floats]:
    """Vectors (line, 3) square to each line, to the point nearest to all; and derivative (line, 3, param)."""
    point, point_by = nearest_point(lines)
    across = _across(lines.direction)
    offset = np.einsum("kij,kj->ki", across, point - lines.point_m)
    return offset, across @ (point_by - lines.point_by) + _turned(lines, point)


def _across(direction: Floats) -> Floats:
    """(line, 3, 3) projectors on the plane across each line."""
    return np.eye(3) - direction[:, :, None] * direction[:, None, :]


def _turned(lines: Lines, point: Floats) -> Floats:
    """(line, 3, param) change of P_k (point - p_k) by turning P_k alone."""
    lever = point - lines.point_m
    along = np.einsum("ki,ki->k", lines.direction, lever)
    sideways = np.einsum("kim,ki->km", lines.direction_by, lever)
    return -(lines.direction_by * along[:, None, None] + lines.direction[:, :, None] * sideways[:, None, :])
