"""How a joint may be counted otherwise than the rig has it: another zero, one joint following another, another sign.

Arms with a parallelogram, and some controllers, give joint 3 against the base or the horizontal instead of against link
2. Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics, 2009, ch. 2.9.2 (parallelogram arm).

Controllers choose the senses of their joints freely; KUKA counts A1, A4 and A6 against the D-H model of the usual
tables. Where links 2 and 3 move in one plane, these three signs together mirror the arm at that plane.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.gross_errors.hypothesis import Hypothesis
from calibrate.model.checks.gross_error import BlunderKind

Floats = NDArray[np.float64]


def shifted(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone, shifted by 90, 180 or -90 degrees. Source: the usual differences between zero conventions."""
    for j in range(n_joints):
        for degrees in (90, 180, -90):
            shift = np.where(np.arange(n_joints) == j, np.radians(degrees), 0.0)
            yield Hypothesis(
                BlunderKind.JOINT_OFFSET,
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
                BlunderKind.JOINT_COUPLING,
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
        BlunderKind.JOINT_SIGN,
        f"{'column' if one else 'columns'} {columns}",
        f"{in_words(joints)} {'turns' if one else 'turn'} against the rig's sense",
        f"in the rig file, write sign = -1 for {in_words(joints)}{_makes(joints)}, or remove it there",
        lambda q: q * sign,
        joints,
    )
