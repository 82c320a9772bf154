"""What a rival method is: it learns what geometry alone leaves, and is asked where and why."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Learnt:
    """What it predicts of unseen samples, and what it would tell a person."""

    predicted: Floats  # (sample, channel) in sigmas
    says: str


class Method(Protocol):
    """A rival: one file, one line in methods.METHODS."""

    @property
    def name(self) -> str: ...

    @property
    def needs(self) -> str:
        """The module that has to be installed."""
        ...

    def learn(self, X: Floats, y: Floats, unseen: Floats, names: tuple[str, ...]) -> Learnt:
        """From features (sample, feature) and misfit (sample, channel) in sigmas, for unseen features."""
        ...
