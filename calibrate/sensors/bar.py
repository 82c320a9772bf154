"""Which rows of a session form lengths: both ends of a bar, and consecutive poses of a tracker without a frame."""

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

SHORTEST_M = 1e-3  # shorter distances hardly depend on the arm, and one of zero has no direction


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
