"""How a centring run ended, and the record of each of its steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look

Floats = NDArray[np.float64]


class CentringStatus(Enum):
    """Every way in which centring ends; the value is the sentence for a person."""

    CENTRED = "all four spot coordinates are within the tolerance"
    OUT_OF_STEPS = "the step limit was reached; the fixture pose may be wrong by more than 90 deg"
    LIMIT_CYCLE = "the steps no longer bring the spots closer; the tolerance is below the arm's repeatability"
    SPOT_LOST = "the light left a face and going back did not find it"
    JOINT_LIMIT = "the next step would leave the joint range"
    NO_LIGHT = "there was no light on both faces to begin with; search first"


@dataclass(frozen=True)
class Step:
    """One motion of the servo and what was seen after it; probing and going back count as steps too."""

    q_rad: Floats  # (joint,) commanded
    spots_m: Floats  # (4,) NaN where dark
    purpose: str  # "start", "probe", "correct", "roll", "go back"


@dataclass(frozen=True)
class Centring:
    """A finished run. `steps` counts motions; the starting look is not one."""

    status: CentringStatus
    strategy: str
    trace: Sequence[Step]
    look: Look  # the last one

    @property
    def steps(self) -> int:
        return len(self.trace) - 1

    @property
    def losses(self) -> int:
        """How often a step led out of the light."""
        lit = [bool(np.isfinite(step.spots_m).all()) for step in self.trace]
        return sum(before and not after for before, after in pairwise(lit))
