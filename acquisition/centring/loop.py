"""The centring loop: look, ask the strategy, limit the step, move, recover a lost spot, end with a named status.

A strategy proposes joint steps and learns from what was seen; the run keeps a record of each step.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.aim import AssumedArm

Floats = NDArray[np.float64]


class CentringStatus(Enum):
    """Every way in which centring ends; the value is the sentence for a person."""

    CENTRED = "all four spot coordinates are within the tolerance"
    OUT_OF_STEPS = "the step limit was reached; the fixture pose may be wrong by more than 90°"
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


@dataclass(frozen=True)
class Limits:
    """Bounds of one run."""

    tolerance_m: float = 5e-6  # on each of the four coordinates
    max_steps: int = 40
    step_rad: float = 0.2  # largest joint step
    dwell_s: float = 0.05  # 50 samples of 2 µm: 0.3 µm
    halvings: int = 6  # of a step that lost the light
    cycle: int = 6  # steps without a better reading that end a run near the target
    cycle_m: float = 1e-4  # "near"


GOOD, POOR = 0.5, 0.25  # shares of its promise that a step kept
LEAST_TRUST_RAD = 1e-3  # feels right: less brings the spots nowhere within the steps of a run


class Loop:
    """One run; the only owner of its trace."""

    def __init__(self, bench: Bench, arm: AssumedArm, strategy: Strategy, limits: Limits) -> None:
        self._bench, self._arm, self._strategy, self._limits = bench, arm, strategy, limits
        self._trace: list[Step] = []
        self._q_rad = np.empty(0)
        self._trusted_rad = limits.step_rad  # largest joint step that may be taken now
        self._losses = 0  # steps that led out of the light

    def run(self, q_rad: Floats, target_m: Floats) -> Centring:
        """Bring the spots to `target_m` (4,), starting where the arm stands at command `q_rad` (joint,)."""
        self._q_rad = q_rad
        look = self._see(q_rad, "start")
        if not _both_lit(look):
            return self._end(CentringStatus.NO_LIGHT, look)
        self._strategy.learn(q_rad, look.spots_m())
        best_m, since_best = np.inf, 0
        while True:
            error_m = float(np.max(np.abs(look.spots_m() - target_m)))
            if error_m <= self._limits.tolerance_m:
                return self._end(CentringStatus.CENTRED, look)
            best_m, since_best = (error_m, 0) if error_m < best_m else (best_m, since_best + 1)
            if since_best >= self._limits.cycle and best_m < self._limits.cycle_m:
                return self._end(CentringStatus.LIMIT_CYCLE, look)
            if len(self._trace) > self._limits.max_steps:
                return self._end(CentringStatus.OUT_OF_STEPS, look)
            proposal = self._limited(self._strategy.propose(target_m))
            if not self._in_range(self._q_rad + proposal.step_rad):
                return self._end(CentringStatus.JOINT_LIMIT, look)
            losses = self._losses
            taken = self._take(proposal)
            if not _both_lit(taken):
                return self._end(CentringStatus.SPOT_LOST, taken)
            if 0 < self._losses == losses:
                self._trust_again(proposal, (look.spots_m() - target_m, taken.spots_m() - target_m))
            look = taken if not proposal.stay else look

    def _take(self, proposal: Proposal) -> Look:
        """Move; while the light is lost, come back by half. The look is dark when that did not find it again: the
        spiral of the search is the caller's.

        A step that lost the light has shown how little the strategy knows yet: the next one is at most half of what
        of it kept the light, and longer only as steps keep their promise. `centring_cold` of the benchmarks counts
        how often the light is lost again all the same.
        """
        step = proposal.step_rad
        look = self._see(self._q_rad + step, proposal.purpose)
        lost = not _both_lit(look)
        self._losses += lost
        for _ in range(self._limits.halvings):
            if _both_lit(look):
                break
            step = step / 2.0
            look = self._see(self._q_rad + step, "go back")
        if _both_lit(look):
            self._trusted_rad = 0.5 * _largest(step) if lost else self._trusted_rad
            self._strategy.learn(self._q_rad + step, look.spots_m())
            if not proposal.stay:
                self._q_rad = self._q_rad + step
        return look

    def _trust_again(self, taken: Proposal, errors_m: tuple[Floats, Floats]) -> None:
        """A step that brought at least half of what it promised doubles the trust, a poor one halves it.

        `errors_m` (4,) before and after. Source: J. Nocedal, S. Wright, Numerical Optimization, 2006, algorithm 4.1.
        """
        if taken.stay or taken.promise == 0.0:
            return
        before_m, after_m = (float(np.linalg.norm(error_m)) for error_m in errors_m)
        kept = (before_m - after_m) / (taken.promise * before_m)
        if kept > GOOD:
            self._trusted_rad = min(2.0 * self._trusted_rad, self._limits.step_rad)
        elif kept < POOR:
            self._trusted_rad = max(0.5 * self._trusted_rad, LEAST_TRUST_RAD)

    def _see(self, q_rad: Floats, purpose: str) -> Look:
        if purpose != "start":
            self._bench.move(q_rad)
        look = self._bench.look(self._limits.dwell_s)
        self._trace.append(Step(q_rad, look.spots_m(), purpose))
        return look

    def _limited(self, proposal: Proposal) -> Proposal:
        largest_rad = _largest(proposal.step_rad)
        if largest_rad <= self._trusted_rad:
            return proposal
        share = self._trusted_rad / largest_rad
        return replace(proposal, step_rad=share * proposal.step_rad, promise=share * proposal.promise)

    def _in_range(self, q_rad: Floats) -> bool:
        return bool(np.all(q_rad >= self._arm.lower_rad) and np.all(q_rad <= self._arm.upper_rad))

    def _end(self, status: CentringStatus, look: Look) -> Centring:
        return Centring(status, self._strategy.name, tuple(self._trace), look)


def centre(
    bench: Bench, arm: AssumedArm, strategy: Strategy, q_rad: Floats, target_m: Floats, limits: Limits | None = None
) -> Centring:
    """Bring both spots to `target_m` (4,) m; the arm stands at command `q_rad`. Never raises for lack of light."""
    return Loop(bench, arm, strategy, limits or Limits()).run(q_rad, target_m)


def _largest(step_rad: Floats) -> float:
    return float(np.max(np.abs(step_rad)))


def _both_lit(look: Look) -> bool:
    return look.psd1.lit and look.psd2.lit
