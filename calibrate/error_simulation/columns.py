"""From sources to what the compiled loops want: columns that are drawn, and the weights of columns in slots."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.source import Source
from calibrate.kernels.perturbed import CELLS, NORMAL, TABLE, UNIFORM, ArmAtPoses, DrawnColumns

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Columns:
    """`of_source` (source, 2): the column of each source's value or C, and that of its S, or -1."""

    drawn: DrawnColumns
    of_source: Ints

    @property
    def count(self) -> int:
        return len(self.drawn.law)


def columns_of(sources: Sequence[Source]) -> Columns:
    """Normal columns first and even in number, then the others, then phases."""
    kinds = np.array([source.law.columns[0] for source in sources])
    normal = np.flatnonzero(kinds == NORMAL)
    idle = len(normal) % 2
    order = [*normal.tolist(), *([-1] * idle), *np.flatnonzero(kinds != NORMAL).tolist()]
    phased = [i for i, source in enumerate(sources) if source.phased]
    n = len(order) + len(phased)
    law, loc, scale = np.full(n, UNIFORM), np.zeros(n), np.ones(n)
    of_source, table_of, tables = np.full((len(sources), 2), -1), np.zeros(n, dtype=np.int64), list[Floats]()
    for column, i in enumerate(order):
        if i < 0:
            law[column], scale[column] = NORMAL, 0.0
            continue
        of_source[i, 0] = column
        law[column], loc[column], scale[column] = sources[i].law.columns
        if law[column] == TABLE:
            table_of[column] = len(tables)
            tables.append(sources[i].law.table())
    of_source[phased, 1] = np.arange(len(order), n)
    polar = of_source[phased].reshape(-1, 2)
    stacked = np.stack(tables) if tables else np.zeros((1, 3, CELLS + 1))
    drawn = DrawnColumns(law.astype(np.int64), loc, scale, stacked, table_of, np.ascontiguousarray(polar))
    return Columns(drawn, of_source)


def arm_at(machine: Machine, sources: Sequence[Source], columns: Columns, q_rad: Floats) -> ArmAtPoses:
    """The machine at readings (pose, joint), with every term of every source."""
    slots, index, weights = list[int](), list[int](), list[Floats]()
    for source, own in zip(sources, columns.of_source.tolist(), strict=True):
        for term in source.terms:
            for column, weight in zip(own, term.weights(q_rad).T, strict=True):
                if column >= 0:
                    slots.append(term.slot)
                    index.append(column)
                    weights.append(weight)
    return ArmAtPoses(
        machine.fixed,
        q_rad + machine.offset_rad,
        machine.point_m,
        np.array(slots, dtype=np.int64),
        np.array(index, dtype=np.int64),
        np.ascontiguousarray(np.stack(weights, axis=1)),
    )
