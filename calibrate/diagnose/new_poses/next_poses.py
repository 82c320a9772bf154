"""Which poses would best separate alternatives: those where the other, refitted to what the one predicts, misses most.

T-optimal, one pose after the other, the alternative refitted after each; of several pairs the closest one chooses.
Sources: Atkinson, Fedorov, The design of experiments for discriminating between two rival models, Biometrika 62(1),
1975; Dette, Melas, Shpilev, Ann. Statist. 43(5), 2015.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Contest:
    """A finding and its alternative over some poses, whitened: rows of one pose together."""

    finding: Floats  # (pose, k) what the finding adds to the readings
    rival: Floats  # (pose, k, m) geometry and the alternative's coefficients: what may be refitted to imitate it


@dataclass(frozen=True)
class Duel:
    """What is measured and assumed already, rows (row, m) and (row,); and what each new pose would add."""

    measured: Floats
    measured_finding: Floats
    offered: Contest


@dataclass(frozen=True)
class Chosen:
    """Poses in the order of choice, and how far apart the closest alternatives are after each."""

    poses: Ints  # (count,) of the candidates
    separation: Floats  # (1 + count,) whitened squares: the BIC margin to expect, without any new pose first


def next_poses(duels: Sequence[Duel], count: int = limits.NEW_POSES) -> Chosen:
    """From candidate poses, which are the same in all duels; every pose is taken once. ValueError without a duel."""
    standings = [_start(duel) for duel in duels]
    open_ = np.ones(len(duels[0].offered.finding), dtype=bool)
    chosen: list[int] = []
    separation = [min(s.separation for s in standings)]
    for _ in range(min(count, len(open_))):
        closest = min(range(len(duels)), key=lambda i: standings[i].separation)
        worth = standings[closest].worth(duels[closest].offered)
        best = int(np.argmax(np.where(open_, worth, -np.inf)))
        chosen.append(best)
        open_[best] = False
        standings = [
            s.after(duel.offered.rival[best], duel.offered.finding[best])
            for s, duel in zip(standings, duels, strict=True)
        ]
        separation.append(min(s.separation for s in standings))
    return Chosen(np.array(chosen, dtype=np.intp), np.array(separation))


def reach_of(duel: Duel) -> float:
    """Separation that all candidate poses together would bring: near zero where one can always imitate the other."""
    offered = duel.offered
    return _start(duel).after(offered.rival.reshape(-1, offered.rival.shape[-1]), offered.finding.ravel()).separation


@dataclass(frozen=True)
class _Standing:
    """Normal equations of the alternative fitted to what the finding predicts."""

    information: Floats
    wanted: Floats
    square: float

    @cached_property
    def imitation(self) -> Floats:
        return np.asarray(np.linalg.solve(self.information, self.wanted), dtype=np.float64)

    @property
    def separation(self) -> float:
        return self.square - float(self.wanted @ self.imitation)

    def worth(self, offered: Contest) -> Floats:
        """(pose,) separation that each pose would add, the alternative refitted to it: e^T (I + X A^-1 X^T)^-1 e."""
        error = offered.finding - offered.rival @ self.imitation
        spread = offered.rival @ np.linalg.solve(self.information, np.swapaxes(offered.rival, 1, 2))
        spread[:, range(error.shape[1]), range(error.shape[1])] += 1.0
        return np.einsum("pk,pk->p", error, np.linalg.solve(spread, error[..., None])[..., 0])

    def after(self, X: Floats, y: Floats) -> "_Standing":
        """With more rows (row, m), and what the finding adds to them."""
        return replace(
            self,
            information=self.information + X.T @ X,
            wanted=self.wanted + X.T @ y,
            square=self.square + float(y @ y),
        )


def _start(duel: Duel) -> _Standing:
    X, y = duel.measured, duel.measured_finding
    information = X.T @ X
    information += 1e-12 * np.trace(information) / max(len(information), 1) * np.eye(len(information))
    return _Standing(information, X.T @ y, float(y @ y))
