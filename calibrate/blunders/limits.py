"""Single angles that the joint cannot have had: beyond the range that the rig states, whatever an instrument says."""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.blunders.finding import Blunder, BlunderKind

Floats = NDArray[np.float64]

SLACK_RAD = 0.1  # a zero may be 4.5 deg off (calibrate/arms/belief.py), and ranges are stated in round numbers
SHARE = 0.1  # of the rows: beyond, it is the stated range that is in question and the instruments decide


def rows_beyond_limits(samples: Samples, limits_rad: Floats) -> tuple[Blunder, ...]:
    """One blunder a row whose angles leave their range (joint, 2)."""
    q_rad = samples.joints()
    beyond = (q_rad < limits_rad[:, 0] - SLACK_RAD) | (q_rad > limits_rad[:, 1] + SLACK_RAD)
    rows = np.flatnonzero(beyond.any(axis=1))
    if len(rows) > SHARE * len(q_rad):
        return ()
    return tuple(_blunder(row, beyond[row], q_rad[row], limits_rad) for row in rows.tolist())


def _blunder(row: int, beyond: NDArray[np.bool_], q_rad: Floats, limits_rad: Floats) -> Blunder:
    joints = np.flatnonzero(beyond).tolist()
    values = ", ".join(f"{q_rad[j]:g} rad is not within {limits_rad[j, 0]:g} to {limits_rad[j, 1]:g}" for j in joints)
    columns = ", ".join(f"q{j + 1}_rad" for j in joints)
    return Blunder(BlunderKind.BEYOND_LIMITS, (row,), columns, values, "correct the cell, or the range in the rig")
