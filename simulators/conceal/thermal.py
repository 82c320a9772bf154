"""Temperatures of a session: the room wanders, motors warm the joints, joints warm the links, the laser warms itself.

Each is one thermal mass (first-order lag: Newton's law of cooling); solved on a grid of 20 s, read off in between.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]
GRID_S = 20.0
START_DEGC = 21.5
REST_S = 45.0  # longer without a sample, and the drives are held by their brakes


def temperatures(t_s: Floats, n_joints: int, rng: np.random.Generator) -> Mapping[str, Floats]:
    """By place, (row,) degC: "room", "joint<i>", "link<i>", "laser". Near its samples the arm works, else it rests."""
    grid_s = np.arange(0.0, t_s[-1] + 2.0 * GRID_S, GRID_S)
    following = np.clip(np.searchsorted(t_s, grid_s), 1, t_s.size - 1)
    apart_s = np.minimum(np.abs(grid_s - t_s[following - 1]), np.abs(t_s[following] - grid_s))
    busy = (apart_s < REST_S).astype(np.float64)
    room = _room(grid_s, rng)
    found = {"room": room}
    for joint in range(1, n_joints + 1):
        rise_k = rng.uniform(4.0, 12.0)
        motor = room + _lagged(rise_k * busy, float(rng.uniform(900.0, 2400.0)))
        found[f"joint{joint}"] = motor
        share = rng.uniform(0.3, 0.6)
        found[f"link{joint}"] = room + _lagged(share * (motor - room), float(rng.uniform(600.0, 1800.0)))
    found["laser"] = room + _lagged(np.full_like(grid_s, rng.uniform(3.0, 6.0)), float(rng.uniform(300.0, 900.0)))
    return {where: np.interp(t_s, grid_s, degC) for where, degC in found.items()}


def _room(grid_s: Floats, rng: np.random.Generator) -> Floats:
    """A wandering room: two slow waves and a filtered random walk, about +-1.5 K."""
    waves = sum(
        rng.uniform(0.3, 1.0) * np.sin(2.0 * np.pi * grid_s / rng.uniform(2400.0, 9000.0) + rng.uniform(0.0, 6.28))
        for _ in range(2)
    )
    walk = _lagged(np.cumsum(rng.normal(0.0, 0.06, grid_s.size)), 300.0)
    return START_DEGC + waves + walk


def _lagged(drive: Floats, time_constant_s: float) -> Floats:
    """First-order lag from rest, exact for a drive that holds within each step of the grid."""
    keep = float(np.exp(-GRID_S / time_constant_s))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], drive), dtype=np.float64)
