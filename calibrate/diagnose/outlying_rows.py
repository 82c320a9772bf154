"""Rows of an instrument that stand apart from all others, and whether that is a gross error or physics.

A wrong digit stands alone and far off, with nothing between it and the rest; physics makes residuals of all sizes, or
moves rows that follow one another. So only few, single rows behind a gap are gross errors before physics is sought.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.checks.gross_error import LIMIT, outlying, robust_scale, runs_of

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

GAP = 4.0  # times the next smaller misfit
FEW = 0.05  # of the rows, and
AT_LEAST = 3
RUN = 3  # rows in a row: something happened, and lasted
FEWEST_ROWS = 12  # of an instrument: below, it is open which row is the odd one


def alone(distance: Floats, k: int, place: Ints) -> Ints:
    """Observations to leave out before physics is sought.

    `distance` (obs,) whitened misfit over k coordinates in the order they were taken; `place` (obs,) where the fixture
    or the probe stood, -1 where that is no question.
    """
    apart = behind_gap(distance, k)
    if not 0 < int(apart.sum()) <= max(AT_LEAST, FEW * len(distance)):
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero(apart & ~lasting(apart, place))


def behind_gap(distance: Floats, k: int) -> Bools:
    """(obs,) farther than any noise, and with a gap to all that are nearer."""
    order = np.argsort(distance)
    size = np.maximum(distance[order], robust_scale(distance, k))
    after_gap = (size[1:] > GAP * size[:-1]) & (size[1:] > LIMIT * robust_scale(distance, k))
    out = np.zeros(len(distance), dtype=bool)
    if len(distance) >= FEWEST_ROWS and after_gap.any():
        out[order[int(np.argmax(after_gap)) + 1 :]] = True
    return out


def lasting(apart: Bools, place: Ints) -> Bools:
    """(obs,) of those apart the ones that follow one another, among all rows or among those of one place."""
    out = _in_runs(apart)
    for one in np.unique(place):
        mine = np.flatnonzero(place == one)
        out[mine] |= _in_runs(apart[mine])
    return out


def unexplained_rows(whitened: Floats) -> Ints:
    """Observations (obs, k) that no model explains; none where they are so many that it is the model which is wrong."""
    distance = np.linalg.norm(whitened, axis=1)
    bad = np.flatnonzero(outlying(distance, whitened.shape[1]))
    return bad if len(bad) <= max(AT_LEAST, FEW * len(distance)) else np.zeros(0, dtype=np.intp)


def _in_runs(apart: Bools) -> Bools:
    out = np.zeros(len(apart), dtype=bool)
    for first, last in runs_of(np.flatnonzero(apart).tolist()):
        if last - first + 1 >= RUN:
            out[first : last + 1] = True
    return out
