"""The believed rig during a session, and how samples better it: passed in, because it rests on the kinematic models."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.believed import BelievedArm, FixtureOptics
from acquisition.sample import Sample

Floats = NDArray[np.float64]


class Learner(Protocol):
    """What is believed now."""

    @property
    def arm(self) -> BelievedArm: ...

    @property
    def optics(self) -> FixtureOptics: ...

    def T_base_fixture(self, placement: int) -> Floats: ...

    def learn(self, samples: list[Sample]) -> None:
        """Refit arm, laser mount and places to all samples so far."""
        ...
