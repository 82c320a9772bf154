"""A source of error: one number that is drawn for every arm, and where it acts.

What a shaft off its axis or a bearing out of round does repeats with the joint's angle, from a phase that nobody
knows: such a source draws its phase evenly beside its size. With the columns C = A cos f, S = A sin f of a size A and
a phase f, A sin(k q + f) = C sin k q + S cos k q, A cos(k q + f) = C cos k q - S sin k q: linear in both columns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.error_simulation.sources import Law

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Wave:
    """sin(order q_joint + phase), or its cosine."""

    joint: int  # from 0
    order: float
    cosine: bool = False


@dataclass(frozen=True)
class Term:
    """What a source adds to a slot: weight times its value, times the wave where there is one."""

    slot: int
    weight: float = 1.0
    wave: Wave | None = None

    def weights(self, q_rad: Floats) -> Floats:
        """(pose, 2) of the columns C and S; of a term without a wave the first alone counts."""
        out = np.zeros((len(q_rad), 2))
        if self.wave is None:
            out[:, 0] = self.weight
            return out
        angle = self.wave.order * q_rad[:, self.wave.joint]
        c, s = np.cos(angle), np.sin(angle)
        out[:, 0], out[:, 1] = (c, -s) if self.wave.cosine else (s, c)
        return self.weight * out


@dataclass(frozen=True)
class Source:
    """`terms` either all have a wave or none."""

    name: str  # "link2.x"
    group: str  # line of the error budget: "link lengths"
    unit: str  # "m", "rad" or "K", of the law
    law: Law
    terms: tuple[Term, ...]

    @property
    def phased(self) -> bool:
        """Whether a phase is drawn, too."""
        return self.terms[0].wave is not None

    @property
    def moments(self) -> tuple[Floats, Floats]:
        """Means (column,) and variances (column,) of the source's columns: one, or C and S."""
        if self.phased:  # even phases: no mean, half of the square each, no covariance
            return np.zeros(2), np.full(2, self.law.square / 2.0)
        return np.array([self.law.mean]), np.array([self.law.variance])

    def by_column(self, by_slot: Floats, q_rad: Floats) -> Floats:
        """(pose, 3, column) derivative of the probe by the columns, from that by slots (pose, 3, slot)."""
        out = np.zeros((len(q_rad), 3, 2))
        for term in self.terms:
            out += by_slot[:, :, term.slot, None] * term.weights(q_rad)[:, None, :]
        return out if self.phased else out[..., :1]
