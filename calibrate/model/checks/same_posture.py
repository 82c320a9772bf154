"""Before a row is called a fault, its neighbours in posture: where those taken at other times err alike, it is the arm.

A wrong digit, a bad shot or another session has nothing to do with where the arm stood. An error of the arm comes back
whenever the arm comes back to that posture.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Bools = NDArray[np.bool_]

NEIGHBOURS = 3  # nearest in posture, of those taken at other times; more than half have to err alike
AS_NEAR = 2.0  # times the distance of the nearest: farther ones show nothing
MORE_THAN = 0.5
APART = 5  # rows in the order of capture: nearer ones may share a fault
SIZE = (0.4, 2.5)  # of an error alike, over the row's own
COSINE = 0.8  # between both errors


def postures(q_rad: Floats) -> Floats:
    """(row, 2 joint) between which distances are those of postures, whole turns apart or not."""
    return np.concatenate([np.cos(q_rad), np.sin(q_rad)], axis=1)


def err_alike(misfit: Floats, posture: Floats, among: Rows, elsewhere: Bools | None = None) -> Bools:
    """(among,) whether the nearest neighbours in posture err as each of these rows does.

    `misfit` (row, k), `posture` (row, n), rows in the order of capture; `elsewhere` (row,) which may be neighbours, all
    if None.
    """
    out = np.zeros(len(among), dtype=bool)
    others = np.arange(len(misfit)) if elsewhere is None else np.flatnonzero(elsewhere)
    for at, row in enumerate(among.tolist()):
        free = others[np.abs(others - row) > APART]
        if len(free) == 0:
            continue
        away = np.linalg.norm(posture[free] - posture[row], axis=1)
        near = np.argsort(away, kind="stable")[:NEIGHBOURS]
        near = free[near[away[near] <= AS_NEAR * away[near[0]]]]
        own, there = float(np.linalg.norm(misfit[row])), np.linalg.norm(misfit[near], axis=1)
        along = misfit[near] @ misfit[row] / np.maximum(there * own, 1e-300)
        alike = (along > COSINE) & (there > SIZE[0] * own) & (there < SIZE[1] * own)
        out[at] = bool(np.mean(alike) > MORE_THAN)
    return out
