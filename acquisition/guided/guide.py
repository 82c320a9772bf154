"""Who moves the probe: a person who is told, or an emulated hand; and what either is told."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.coverage import Coverage
from acquisition.guided.target import Target

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Request:
    """Put the probe there, about in this posture."""

    target: Target
    posture_rad: Floats  # (n,)
    attempt: int  # from 1


@dataclass(frozen=True, eq=False)
class GuidedProgress:
    """How the session stands, for the eye."""

    done: int  # readings
    planned: int
    says: str  # what the probe does, or what was wrong
    q_rad: Floats  # (n,) now; nan before the first sample
    request: Request
    coverage: Coverage
    repeatability_m: float | None  # scatter of the probe in its seats by the arm as known so far


class Guide(Protocol):
    """Told by the session."""

    def ask(self, request: Request) -> bool:
        """False: whoever moves the probe says that it does not get there; another posture will be asked for."""
        ...

    def tell(self, progress: GuidedProgress) -> None:
        """Now and then, and at every change."""
        ...
