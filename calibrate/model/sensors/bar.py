"""Instrument: a bar of known length; the probe sits in its ends in turn, and consecutive rows form one length."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import BAR, BAR_END
from calibrate.errors import DataError
from calibrate.model.checks.rough_fit import least_distance, median
from calibrate.model.checks.witness import (
    Otherwise,
    Strain,
    Witness,
    drawn_point_m,
    filled,
    thinned,
)
from calibrate.model.problem import Measured
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import SensorKind, Trait
from calibrate.model.sensors.seat import NOISE, predicted_tips, seat_sigma_m
from calibrate.model.sensors.tip_distance import PairChain, TipDistance

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

FEWEST_PAIRS = 15  # one number each; the target has three unknowns


@dataclass(frozen=True)
class BarWitness:
    """The target is found; a drawn one should not have to move."""

    q_rad: Floats  # (2 pair, joint) all ends a, then all ends b
    length_m: Floats  # (pair,)
    point_m: Floats | None  # (3,) target at its nominal place in the flange frame

    def strain(self, T_base_flange: Floats) -> Strain:
        a, b = np.split(T_base_flange, 2, axis=-3)
        turns, apart = b[..., :3, :3] - a[..., :3, :3], b[..., :3, 3] - a[..., :3, 3]
        drawn = np.zeros(3) if self.point_m is None else self.point_m

        def rows(shift: Floats) -> tuple[Floats, Floats]:
            span = (turns @ (drawn + shift)[..., None, :, None])[..., 0] + apart
            length = np.maximum(np.linalg.norm(span, axis=-1), 1e-9)
            along = span / length[..., None]
            return length - self.length_m, (along[..., None, :] @ turns)[..., 0, :]

        shift, distance = least_distance(rows, np.zeros((*apart.shape[:-2], 3)))
        moved = np.linalg.norm(shift, axis=-1)
        return Strain(median(distance), 0.0 * moved if self.point_m is None else moved)

    def otherwise(self) -> Iterator[Otherwise]:
        """The length stands in the rig, not in the samples."""
        yield from ()


def bar_pairs(rows: Indices, bar: NDArray[np.int64], end: NDArray[np.str_]) -> Indices:
    """(pair, 2) rows of end a and end b from the rows that have a bar, in the order of the session.

    Consecutive rows form one length. DataError naming the row, from 1, that has no partner.
    """
    if len(rows) % 2:
        raise DataError(
            f"samples row {rows[-1] + 1}, column 'bar_end': end {end[-1]} of bar {bar[-1]} without the other end; "
            "take or drop it"
        )
    pairs: list[tuple[int, int]] = []
    for i in range(0, len(rows), 2):
        ends = {str(end[i]): int(rows[i]), str(end[i + 1]): int(rows[i + 1])}
        if bar[i] != bar[i + 1] or set(ends) != {"a", "b"}:
            raise DataError(
                f"samples row {rows[i + 1] + 1}, column 'bar_end': end {end[i + 1]} of bar {bar[i + 1]} follows end "
                f"{end[i]} of bar {bar[i]} (row {rows[i] + 1}); consecutive rows a, b of one bar form a length: "
                "correct or drop the odd one"
            )
        pairs.append((ends["a"], ends["b"]))
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(BAR)
    if len(rows) == 0:
        return None
    if BAR_END not in table.samples:
        raise DataError("samples: column bar without bar_end; add the end, a or b, of each row")
    bar = table.samples.integers(BAR, 0)
    pairs = bar_pairs(rows, bar[rows], table.samples.columns[BAR_END][rows])
    lengths = {k: b.length_m for k, b in table.rig.bars.items()}
    unknown = set(bar[rows].tolist()) - set(lengths)
    if unknown:
        raise DataError(f"samples: bar {min(unknown)} is not in the rig; add a [[bar]] with its length")
    length_m = np.array([[lengths[int(k)]] for k in bar[pairs[:, 0]]])
    own = {NOISE.name: np.full((len(pairs), 1), np.sqrt(2.0) * seat_sigma_m(table.rig))}
    return table.measured(KIND.name, PairChain(table.arm, TipDistance(table.target)), pairs, length_m, own)


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    """Pairs of neighbouring rows that are ends of one bar; odd rows are reported when the instrument is built."""
    rows = filled(samples, BAR)
    if len(rows) < 2 or BAR_END not in samples:
        return None
    bar, end = samples.integers(BAR, 0)[rows], samples.columns[BAR_END][rows]
    rows, bar = rows[: len(rows) // 2 * 2].reshape(-1, 2), bar[: len(rows) // 2 * 2].reshape(-1, 2)
    pair = (bar[:, 0] == bar[:, 1]) & (end[0 : 2 * len(bar) : 2] != end[1 : 2 * len(bar) : 2])
    pair &= np.isin(bar[:, 0], list(rig.bars))
    kept = thinned(np.flatnonzero(pair))
    if len(kept) < FEWEST_PAIRS:
        return None
    length_m = np.array([rig.bars[int(k)].length_m for k in bar[kept, 0]])
    return BarWitness(q_rad[np.concatenate([rows[kept, 0], rows[kept, 1]])], length_m, drawn_point_m(rig))


KIND = SensorKind(
    name="bar",
    columns=(BAR, BAR_END),
    title="Bar lengths",
    noun="bar lengths",
    noise=(NOISE,),
    traits=frozenset({Trait.TARGET, Trait.TOUCHED}),
    asks=(BAR,),
    build=_build,
    witness=_witness,
    predict=predicted_tips,
)
