"""Instrument: positions as distances between consecutive poses, without the device's frame."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import POSITION
from calibrate.errors import DataError
from calibrate.model.checks.witness import stacked
from calibrate.model.problem import Measured
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors import full_pose, position
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    SensorKind,
    Trait,
)
from calibrate.model.sensors.position import NOISE, position_sigma_m, seen_at
from calibrate.model.sensors.tip_distance import PairChain, TipDistance

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

COLUMN = "distance_m"  # from the row before; no session holds it, it follows from the positions
SHORTEST_M = 1e-3  # shorter distances hardly depend on the arm, and one of zero has no direction


def consecutive_pairs(rows: Indices, position_m: Floats) -> tuple[Indices, Floats]:
    """(pair, 2) neighbouring rows and their measured distances (pair, 1), from the positions (row, 3) in any frame.

    Source: patent CN114523474B, step 4. Pairs closer than SHORTEST_M are left out. DataError where none remains.
    """
    length_m = np.linalg.norm(np.diff(position_m, axis=0), axis=1)
    far = np.flatnonzero(length_m > SHORTEST_M)
    if len(far) == 0:
        raise DataError(
            f"distances: {len(rows)} positions, none {SHORTEST_M} m or more from the one before; move the arm"
        )
    return np.stack([rows[far], rows[far + 1]], axis=1), length_m[far, None]


def shared_correlation(position_m: Floats, pairs: Indices) -> Floats:
    """(pair,) correlation of each distance's noise with the next one's by the position that both share; the last is 0.

    Of equal noise: distance i moves by u_i . e_b - u_i . e_a, so neighbours have -u_i . u_(i+1) of a variance of 2.
    """
    span = position_m[pairs[:, 1]] - position_m[pairs[:, 0]]
    along = span / np.linalg.norm(span, axis=1, keepdims=True)
    touching = pairs[:-1, 1] == pairs[1:, 0]
    return np.append(np.where(touching, -0.5 * np.sum(along[:-1] * along[1:], axis=1), 0.0), 0.0)


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(*POSITION)
    if len(rows) == 0:
        return None
    pairs, length_m = consecutive_pairs(rows, table.position_m[rows])
    own = {NOISE.name: np.full((len(pairs), 1), np.sqrt(2.0) * position_sigma_m(table.rig))}
    measured = table.measured(KIND.name, PairChain(table.arm, TipDistance(table.target)), pairs, length_m, own)
    return replace(measured, own_correlation=shared_correlation(table.position_m, pairs))


def _predict(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    """From the row before to each row; none at the first."""
    return {COLUMN: _from_row_before(seen_at(found, T_base_flange, samples))}


def _observed(found: Found, samples: Samples) -> Columns | None:
    return {COLUMN: _from_row_before(stacked(samples, POSITION))} if all(c in samples for c in POSITION) else None


def _from_row_before(position_m: Floats) -> Floats:
    """(row,) of positions (row, 3)."""
    return np.append(np.nan, np.linalg.norm(np.diff(position_m, axis=0), axis=1))


KIND = SensorKind(
    name="distance",
    columns=POSITION,
    title="Distances between positions",
    noun="distances",
    noise=(NOISE,),
    traits=frozenset({Trait.TARGET}),
    instead_of=(position.KIND.name, full_pose.KIND.name),
    reads=(COLUMN,),
    build=_build,
    predict=_predict,
    observed=_observed,
)
