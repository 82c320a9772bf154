"""Discs of encoders as they truly are: off their shafts, and unevenly divided."""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from simulators.defects.encoder import RADIUS_M

Floats = NDArray[np.float64]
LINES = 256  # groups of graduation lines a turn: a head reads some hundred lines at a time and averages them


class TrueDisc(msgspec.Struct, frozen=True):
    """One encoder: its centre off the shaft, seen from the disc, and the angle that each group of lines adds."""

    eccentricity_m: float
    bearing_rad: float
    graduation_rad: tuple[float, ...]


def draw_disc(eccentricity_m: float, graduation_rad: float, rng: np.random.Generator) -> TrueDisc:
    """Of one sigma of each coordinate of its centre, and of the angle that a group of lines shows."""
    x_m, y_m = eccentricity_m * rng.standard_normal(2)
    lines_rad = graduation_rad * rng.standard_normal(LINES)
    return TrueDisc(float(np.hypot(x_m, y_m)), float(np.arctan2(y_m, x_m)), tuple(lines_rad.tolist()))


class Discs:
    """One for each of n shafts; rows are moments: `shaft_rad` (row, n)."""

    def __init__(self, discs: Sequence[TrueDisc]) -> None:
        self._eccentric_m = np.array([disc.eccentricity_m for disc in discs])
        self._bearing_rad = np.array([disc.bearing_rad for disc in discs])
        self._lines_rad = np.array([disc.graduation_rad for disc in discs])

    def off_centre_rad(self, shaft_rad: Floats) -> Floats:
        """(row, n) what discs off their shafts add: exact, two points on a plane (defects/encoder.py)."""
        turn_rad = shaft_rad - self._bearing_rad
        aside_m = self._eccentric_m * np.sin(turn_rad)
        return -np.arctan2(aside_m, RADIUS_M + self._eccentric_m * np.cos(turn_rad))

    def graduation_rad(self, shaft_rad: Floats) -> Floats:
        """(row, n) what unevenly divided discs add, straight between groups of lines."""
        groups = self._lines_rad.shape[1]
        place = np.mod(shaft_rad, 2.0 * np.pi) / (2.0 * np.pi) * groups
        before = np.floor(place).astype(np.intp) % groups
        share, disc = place - np.floor(place), np.arange(len(self._lines_rad))
        lines = self._lines_rad
        return (1.0 - share) * lines[disc, before] + share * lines[disc, (before + 1) % groups]
