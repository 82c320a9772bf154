"""Which times and values a recording can hold: one law for tables, logs, bags, CAN logs and session folders.

The figures are those of `bounds`. A missing value (NaN) is no fault here; who needs it refuses it.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.files.bounds import SPAN_S, TIME_S, most_of


def time_fault(times_s: NDArray[np.float64]) -> tuple[int, str] | None:
    """The first time that cannot be: its row from 0, and what is wrong with it, with the remedy.

    `times_s`: (row,) in s on one clock, since any moment. A time far from all others was written wrongly.
    """
    bad = np.flatnonzero(np.abs(times_s) > TIME_S)
    if bad.size:
        row = int(bad[0])
        return row, f"{times_s[row]:.12g} s is beyond {TIME_S:g} s; correct it, or remove the row"
    there = times_s[np.isfinite(times_s)]
    if there.size < 2 or np.ptp(there) <= SPAN_S:
        return None
    off_s = np.nan_to_num(np.abs(times_s - np.median(there)))
    row = int(np.argmax(off_s))
    return row, (
        f"{times_s[row]:.12g} s is {off_s[row]:.4g} s from the median of all rows, and no session lasts "
        f"{SPAN_S:g} s; correct it, or remove the row"
    )


def value_fault(name: str, values: NDArray[Any], *, infinite: bool = False) -> tuple[int, int, str] | None:
    """The first value that the quantity `name` cannot have: row and element from 0, and what is wrong, with the remedy.

    `values`: (row,) or (row, ...) in the SI unit in which the name ends. `infinite`: infinity is taken, which devices
    send as a mark, and which a recording that comes out of a file again must keep.
    """
    if values.dtype.kind not in "fiu" or not values.size:
        return None
    flat, most = values.reshape(len(values), -1), most_of(name)
    sizes = np.abs(flat.astype(np.float64))
    bad = np.argwhere((sizes > most) & ~(infinite & np.isinf(sizes)))
    if not len(bad):
        return None
    row, element = (int(place) for place in bad[0])
    given = f"{flat[row, element]:g} is beyond {most:g}, the most that '{name}' can hold"
    return row, element, f"{given}; correct it, or leave the cell empty if it is missing"
