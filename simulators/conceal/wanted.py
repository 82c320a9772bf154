"""What is asked for: a family of sessions, its size, what shall be hidden in it, and how its instrument is noisy.

Noise in units of its one sigma: white, with heavy tails, or slowly wandering.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Kind = Literal["white", "heavy", "wandering"]
KINDS: tuple[Kind, ...] = get_args(Kind)
FREEDOM = 4.0  # of Student's t: tails of a shop floor, finite variance
OUTLIER_SHARE = 0.02
OUTLIER_SIGMAS = (6.0, 20.0)
KEEP = 0.95  # lag-one correlation of the wander
WANDER_SHARE = 0.75  # its standard deviation, in sigmas, on top of the white part


def draw_noise(kind: Kind, rows: int, channels: int, rng: np.random.Generator) -> Floats:
    """(row, channel), rows in order of time; the white kind has standard deviation 1."""
    if kind == "white":
        return rng.standard_normal((rows, channels))
    if kind == "heavy":
        noise = rng.standard_t(FREEDOM, (rows, channels)) / np.sqrt(FREEDOM / (FREEDOM - 2.0))
        outlying = np.flatnonzero(rng.random(rows) < OUTLIER_SHARE)
        far = rng.uniform(*OUTLIER_SIGMAS, outlying.size)
        noise[outlying] += far[:, np.newaxis] * _directions(outlying.size, channels, rng)
        return noise
    shocks = rng.standard_normal((rows, channels))
    wander = np.empty_like(shocks)
    wander[0] = shocks[0]
    for row in range(1, rows):
        wander[row] = KEEP * wander[row - 1] + np.sqrt(1.0 - KEEP**2) * shocks[row]
    return rng.standard_normal((rows, channels)) + WANDER_SHARE * wander


def _directions(rows: int, channels: int, rng: np.random.Generator) -> Floats:
    vector = rng.standard_normal((rows, channels))
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)


Family = Literal["dual-psd", "tracker", "cones", "wire"]
FAMILIES: tuple[Family, ...] = get_args(Family)
Side = Literal["link", "motor", "beside"]  # of second encoders: simulators/conceal/observe.py
SIDES: tuple[Side, ...] = get_args(Side)
SimulationKind = Literal["too-much", "constants"]  # a simulation of the session: what it differs by
INSTRUMENT = {"dual-psd": "dual-psd", "tracker": "position", "cones": "seat", "wire": "wire"}


class ConcealError(ValueError):
    """What was asked for cannot be drawn."""


@dataclass(frozen=True)
class Wanted:
    """One session. The same record and seed always give the same recording."""

    family: Family
    seed: int
    defects: tuple[str, ...] = ()  # kinds; "outside": one that no catalogue lists; "any": one that a catalogue may list
    enr: float = 1.0  # wanted effect over noise of each defect
    samples: int = 300
    places: int = 3  # of a fixture; cones: seats
    arm: str | None = None  # by name; None: drawn
    noise: Kind = "white"
    withhold: bool = False  # the column that would name the defect is not recorded
    encoders: Side | None = None  # second encoders are recorded, and defects are of machine-like size, whatever `enr`
    side_stated: bool = False  # the rig file states on which side of the gear they sit
    confused: bool = False  # the rig file states the other of the two conventions of Denavit and Hartenberg
    thermometer_k: float = 0.0  # by which a room thermometer drifts; nothing depends on it. Not 0: it is recorded
    at_least: float = 0.0  # effect over noise of each defect, or the seed is refused
    targets: int = 1  # of a tracker, on the flange, read in turn
    placed_m: float | None = None  # one sigma of where they sit about their drawing; None: as brackets by hand do
    six_d: bool = False  # a tracker reads the orientation of its target, too
    beside: SimulationKind | None = None  # a simulation of the same plan is recorded, too; tracker, rig file in rows
