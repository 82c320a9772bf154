"""One way in which the joint angles of a whole file may have been written by another convention."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.checks.gross_error import BlunderKind

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Hypothesis:
    """What the joint angles would have to be."""

    kind: BlunderKind
    column: str
    what: str
    remedy: str
    angles: Callable[[Floats], Floats]  # (pose, joint) as written -> as meant, rad
    signs: tuple[int, ...] = ()  # joints, from 1, whose sign it changes
