"""Whether a reading can be: what the arm as known so far says of it. Given in from outside, for fits are not here."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from acquisition.guided.reading import Reading


@dataclass(frozen=True)
class Doubt:
    """How far a reading is from where it should be."""

    miss_m: float
    sigmas: float  # of all that is not known yet, arm and noise together

    @property
    def says(self) -> str:
        return f"{1e3 * self.miss_m:.2f} mm ({self.sigmas:.0f} sigma) off; the probe slipped or sits on the rim"


class Judge(Protocol):
    """Learns from what was accepted."""

    def learn(self, readings: Sequence[Reading]) -> None: ...

    def doubt(self, visit: Sequence[Reading]) -> Doubt | None:
        """Of the readings of one visit, against all learned; None where nothing speaks against them."""
        ...

    @property
    def repeatability_m(self) -> float | None:
        """Rms of the probe about its place in each cone, three axes together; None before any was taken twice."""
        ...
