"""Joints that the file counts the other way round than the rig: one of them, or several at once.

Controllers choose the senses of their joints freely; KUKA counts A1, A4 and A6 against the D-H model of the usual
tables. Where links 2 and 3 move in one plane, these three signs together mirror the arm at that plane.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.hypothesis import Hypothesis

EVERY_SET = 8  # joints up to which all sets are tried: 247 of them, in a second
# Against the table with every axis drawn as the one before it turns: docs/robots.md, with sources
MAKES: Mapping[tuple[int, ...], str] = {(1, 4, 6): "KUKA"}
LARGEST_SET = 3  # of longer arms; no controller is known that turns more


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
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
    return f", as for {MAKES[joints]}" if joints in MAKES else ""


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
