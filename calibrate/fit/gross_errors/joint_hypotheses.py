"""By which other conventions the joint angles of a whole file may have been written.

Another zero, one joint following another, another sign, or degrees: far outside the joint limits in many rows, or
explained only when read as degrees.

Arms with a parallelogram, and some controllers, give joint 3 against the base or the horizontal instead of against link
2. Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics, 2009, ch. 2.9.2 (parallelogram arm).

Controllers choose the senses of their joints freely; KUKA counts A1, A4 and A6 against the D-H model of the usual
tables. Where links 2 and 3 move in one plane, these three signs together mirror the arm at that plane.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from calibrate.model.checks.gross_error import GrossError, GrossErrorKind

Floats = NDArray[np.float64]
BEYOND = 2.0  # times the farthest joint limit: no arm reads that in radians
SHARE = 0.1  # of the rows: a single typed digit is not a unit
REMEDY = "write radians (degrees times pi/180)"


@dataclass(frozen=True)
class Hypothesis:
    """What the joint angles would have to be."""

    kind: GrossErrorKind
    column: str
    what: str
    remedy: str
    angles: Callable[[Floats], Floats]  # (pose, joint) as written -> as meant, rad
    signs: tuple[int, ...] = ()  # joints, from 1, whose sign it changes


def shifted(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone, shifted by 90, 180 or -90 degrees. Source: the usual differences between zero conventions."""
    for j in range(n_joints):
        for degrees in (90, 180, -90):
            shift = np.where(np.arange(n_joints) == j, np.radians(degrees), 0.0)
            yield Hypothesis(
                GrossErrorKind.JOINT_OFFSET,
                f"column q{j + 1}_rad",
                f"zero of joint {j + 1} is {abs(degrees)}° beside the rig's",
                f"add {np.radians(degrees):.6f} rad to the column or to theta_offset_rad of joint {j + 1}",
                lambda q, s=shift: q + s,
            )


COUPLED_BY = {(2, 3): ", as for FANUC"}  # who counts so: docs/robots.md, with sources


def coupled(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone, with the angle of its neighbour in front added or taken away."""
    for j in range(1, n_joints):
        for sign in (-1.0, 1.0):
            mixing = np.eye(n_joints)
            mixing[j, j - 1] = sign
            yield Hypothesis(
                GrossErrorKind.JOINT_COUPLING,
                f"column q{j + 1}_rad",
                f"joint {j + 1} is coupled with joint {j}: its angle is not counted from link {j}",
                f"in the rig file, write follows = {{ joint = {j}, by = {sign} }} for joint {j + 1}"
                f"{COUPLED_BY.get((j, j + 1), '')}, or remove it there",
                lambda q, m=mixing: q @ m.T,
            )


EVERY_SET = 8  # joints up to which all sets are tried: 247 of them, in a second


# Against the table with every axis drawn as the one before it turns: docs/robots.md, with sources
TURNED_BY: Mapping[tuple[int, ...], str] = {(1, 4, 6): "KUKA"}


LARGEST_SET = 3  # of longer arms; no controller is known that turns more


def turned(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone with its sign changed."""
    for j in range(1, n_joints + 1):
        yield _turned((j,), n_joints)


def sets(n_joints: int) -> Iterator[Hypothesis]:
    """Two joints or more, small sets first."""
    largest = n_joints if n_joints <= EVERY_SET else LARGEST_SET
    for size in range(2, largest + 1):
        for joints in combinations(range(1, n_joints + 1), size):
            yield _turned(joints, n_joints)


def in_words(joints: tuple[int, ...]) -> str:
    """Joints for a person.

    >>> in_words((1, 4, 6))
    'joints 1, 4 and 6'
    """
    if len(joints) == 1:
        return f"joint {joints[0]}"
    return f"joints {', '.join(str(j) for j in joints[:-1])} and {joints[-1]}"


def _makes(joints: tuple[int, ...]) -> str:
    """Who counts these joints so."""
    return f", as for {TURNED_BY[joints]}" if joints in TURNED_BY else ""


def _turned(joints: tuple[int, ...], n_joints: int) -> Hypothesis:
    sign = np.where(np.isin(np.arange(1, n_joints + 1), joints), -1.0, 1.0)
    columns, one = ", ".join(f"q{j}_rad" for j in joints), len(joints) == 1
    return Hypothesis(
        GrossErrorKind.JOINT_SIGN,
        f"{'column' if one else 'columns'} {columns}",
        f"{in_words(joints)} {'turns' if one else 'turn'} against the rig's sense",
        f"in the rig file, write sign = -1 for {in_words(joints)}{_makes(joints)}, or remove it there",
        lambda q: q * sign,
        joints,
    )


def beyond_limits(q_rad: Floats, limits_rad: Floats) -> GrossError | None:
    """Columns whose angles (pose, joint) cannot be radians between limits (joint, 2); None if all can."""
    beyond = _columns(q_rad, limits_rad)
    if len(beyond) == 0:
        return None
    j = int(beyond[np.argmax(np.max(np.abs(q_rad[:, beyond]), axis=0))])
    worst, limit = float(np.max(np.abs(q_rad[:, j]))), float(np.max(np.abs(limits_rad[j])))
    columns = ", ".join(f"q{k + 1}_rad" for k in beyond)
    what = f"angles up to {worst:g} beside a limit of {limit:g} rad (q{j + 1}_rad): these are degrees"
    return GrossError(GrossErrorKind.DEGREES, (), f"column {columns}", what, REMEDY)


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


def in_degrees(n_joints: int) -> Iterator[Hypothesis]:
    """All columns in degrees, or one of them: a small motion in degrees can lie within the limits."""
    factor = np.pi / 180.0
    what = "the readings are explained only when the angles are read as degrees"
    yield Hypothesis(GrossErrorKind.DEGREES, f"columns q1_rad ... q{n_joints}_rad", what, REMEDY, lambda q: q * factor)
    for j in range(n_joints):
        scale = np.where(np.arange(n_joints) == j, factor, 1.0)
        yield Hypothesis(GrossErrorKind.DEGREES, f"column q{j + 1}_rad", what, REMEDY, lambda q, s=scale: q * s)
