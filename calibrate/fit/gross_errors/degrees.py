"""Joint angles in degrees: far outside the joint limits in many rows, or explained only when read as degrees."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.gross_errors.hypothesis import Hypothesis
from calibrate.model.checks.gross_error import Blunder, BlunderKind

Floats = NDArray[np.float64]

BEYOND = 2.0  # times the farthest joint limit: no arm reads that in radians
SHARE = 0.1  # of the rows: a single typed digit is not a unit
REMEDY = "write radians (degrees times pi/180)"


def beyond_limits(q_rad: Floats, limits_rad: Floats) -> Blunder | None:
    """Columns whose angles (pose, joint) cannot be radians between limits (joint, 2); None if all can."""
    beyond = _columns(q_rad, limits_rad)
    if len(beyond) == 0:
        return None
    j = int(beyond[np.argmax(np.max(np.abs(q_rad[:, beyond]), axis=0))])
    worst, limit = float(np.max(np.abs(q_rad[:, j]))), float(np.max(np.abs(limits_rad[j])))
    columns = ", ".join(f"q{k + 1}_rad" for k in beyond)
    what = f"angles up to {worst:g} beside a limit of {limit:g} rad (q{j + 1}_rad): these are degrees"
    return Blunder(BlunderKind.DEGREES, (), f"column {columns}", what, REMEDY)


def as_radians(q_rad: Floats, limits_rad: Floats) -> Floats:
    """The same angles read as degrees in the column of `beyond_limits`; in all columns where it is several."""
    out = q_rad.copy()
    beyond = _columns(q_rad, limits_rad)
    every = len(beyond) > 1  # degrees of a joint that moves little can resemble radians
    out[:, slice(None) if every else beyond] *= np.pi / 180.0
    return out


def _columns(q_rad: Floats, limits_rad: Floats) -> NDArray[np.intp]:
    """Joints, from 0, whose angles lie far beyond any limit in many rows."""
    if len(q_rad) == 0:
        return np.zeros(0, dtype=np.intp)
    reach = BEYOND * np.max(np.abs(limits_rad), axis=1)
    return np.flatnonzero(np.mean(np.abs(q_rad) > reach, axis=0) > SHARE)


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
    """All columns in degrees, or one of them: a small motion in degrees can lie within the limits."""
    factor = np.pi / 180.0
    what = "the readings are explained only when the angles are read as degrees"
    yield Hypothesis(BlunderKind.DEGREES, f"columns q1_rad ... q{n_joints}_rad", what, REMEDY, lambda q: q * factor)
    for j in range(n_joints):
        scale = np.where(np.arange(n_joints) == j, factor, 1.0)
        yield Hypothesis(BlunderKind.DEGREES, f"column q{j + 1}_rad", what, REMEDY, lambda q, s=scale: q * s)
