"""The centring loop: look, ask the strategy, limit the step, move, recover a lost spot, end with a named status."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.believed import BelievedArm
from acquisition.bench import Bench, Look
from acquisition.servo.status import Centring, Status, Step
from acquisition.servo.strategy import Proposal, Strategy

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """Bounds of one run."""

    tolerance_m: float = 5e-6  # on each of the four coordinates
    max_steps: int = 40
    step_rad: float = 0.2  # largest joint step
    dwell_s: float = 0.05  # 50 samples of 2 um: 0.3 um
    halvings: int = 6  # of a step that lost the light
    cycle: int = 6  # steps without a better reading that end a run near the target
    cycle_m: float = 1e-4  # "near"


class Loop:
    """One run; the only owner of its trace."""

    def __init__(self, bench: Bench, arm: BelievedArm, strategy: Strategy, limits: Limits) -> None:
        self._bench, self._arm, self._strategy, self._limits = bench, arm, strategy, limits
        self._trace: list[Step] = []
        self._q_rad = np.empty(0)

    def run(self, q_rad: Floats, target_m: Floats) -> Centring:
        """Bring the spots to `target_m` (4,), starting where the arm stands at command `q_rad` (joint,)."""
        self._q_rad = q_rad
        look = self._see(q_rad, "start")
        if not _both_lit(look):
            return self._end(Status.NO_LIGHT, look)
        self._strategy.learn(q_rad, look.spots_m())
        best_m, since_best = np.inf, 0
        while True:
            error_m = float(np.max(np.abs(look.spots_m() - target_m)))
            if error_m <= self._limits.tolerance_m:
                return self._end(Status.CENTRED, look)
            best_m, since_best = (error_m, 0) if error_m < best_m else (best_m, since_best + 1)
            if since_best >= self._limits.cycle and best_m < self._limits.cycle_m:
                return self._end(Status.LIMIT_CYCLE, look)
            if len(self._trace) > self._limits.max_steps:
                return self._end(Status.OUT_OF_STEPS, look)
            proposal = self._limited(self._strategy.propose(target_m))
            if not self._in_range(self._q_rad + proposal.step_rad):
                return self._end(Status.JOINT_LIMIT, look)
            taken = self._take(proposal)
            if not _both_lit(taken):
                return self._end(Status.SPOT_LOST, taken)
            look = taken if not proposal.stay else look

    def _take(self, proposal: Proposal) -> Look:
        """Move; while the light is lost, come back by half. The look is dark when that did not find it again: the
        spiral of the search is the caller's.
        """
        step = proposal.step_rad
        look = self._see(self._q_rad + step, proposal.purpose)
        for _ in range(self._limits.halvings):
            if _both_lit(look):
                break
            step = step / 2.0
            look = self._see(self._q_rad + step, "go back")
        if _both_lit(look):
            self._strategy.learn(self._q_rad + step, look.spots_m())
            if not proposal.stay:
                self._q_rad = self._q_rad + step
        return look

    def _see(self, q_rad: Floats, purpose: str) -> Look:
        if purpose != "start":
            self._bench.move(q_rad)
        look = self._bench.look(self._limits.dwell_s)
        self._trace.append(Step(q_rad, look.spots_m(), purpose))
        return look

    def _limited(self, proposal: Proposal) -> Proposal:
        largest = float(np.max(np.abs(proposal.step_rad)))
        if largest <= self._limits.step_rad:
            return proposal
        return Proposal(proposal.step_rad * (self._limits.step_rad / largest), proposal.purpose, proposal.stay)

    def _in_range(self, q_rad: Floats) -> bool:
        return bool(np.all(q_rad >= self._arm.lower_rad) and np.all(q_rad <= self._arm.upper_rad))

    def _end(self, status: Status, look: Look) -> Centring:
        return Centring(status, self._strategy.name, tuple(self._trace), look)


def centre(
    bench: Bench, arm: BelievedArm, strategy: Strategy, q_rad: Floats, target_m: Floats, limits: Limits | None = None
) -> Centring:
    """Bring both spots to `target_m` (4,) m; the arm stands at command `q_rad`. Never raises for lack of light."""
    return Loop(bench, arm, strategy, limits or Limits()).run(q_rad, target_m)


def _both_lit(look: Look) -> bool:
    return look.psd1.lit and look.psd2.lit
