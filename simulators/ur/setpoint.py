"""The set-point and what every generator of set-points offers."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SetPoint:
    """Where the joints shall be, in the controller's own readings; each (n,)."""

    q_rad: Floats
    qd_rad_s: Floats
    qdd_rad_s2: Floats


class Generator(Protocol):
    """One motion. `finished` says that the last set-point was its end; it then stands still."""

    @property
    def finished(self) -> bool: ...

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        """The next set-point. PathBlocked when the arm cannot follow."""
        ...


class PathBlocked(Exception):  # noqa: N818 - the arm is blocked, the program is not in error
    """The path leaves what the joints can do: joint range, joint speed near a singularity, out of reach."""


def standing(q_rad: Floats) -> SetPoint:
    """A set-point at rest."""
    return SetPoint(q_rad, np.zeros(len(q_rad)), np.zeros(len(q_rad)))
