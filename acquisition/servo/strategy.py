"""What a centring strategy is: it proposes joint steps and learns from what was seen."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Proposal:
    """A joint step (joint,) rad and what it is for."""

    step_rad: Floats
    purpose: str
    promise: float = 1.0  # share of the distance to the target that it is meant to remove; 0: it is for something else
    stay: bool = False  # a probe: the next proposal starts from where the probe started


class Strategy(Protocol):
    """Sees every (q, spots) pair in order, the start first; proposes the next step towards `target_m`."""

    name: str

    def learn(self, q_rad: Floats, spots_m: Floats) -> None:
        """A settled reading with light on both faces."""
        ...

    def propose(self, target_m: Floats) -> Proposal: ...
