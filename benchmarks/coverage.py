"""Do 95 % intervals hold the truth 95 times in a hundred? Many drawn sessions, counted by kind of parameter."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.stats import binom

from acquisition.recording.rig import load_rig
from benchmarks.drawn_sessions import POSITION_SIGMA_M, SPOT_SIGMA_M, T_BASE_DEVICE, TARGET_M, Bench, Session
from benchmarks.intervals import intervals
from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.fit.rank.observability import analyse_along, reduced
from calibrate.fit.solvers import NEAR_START, Fit, solve
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.chain import SensorChain
from calibrate.model.dual_psd_rig import dual_psd_chain
from calibrate.model.placement import Device, Target
from calibrate.model.problem import Problem
from calibrate.model.rigid import transform
from calibrate.model.sensors.position import Position

LEVEL = 0.95
AIM = (0.93, 0.97)


@dataclass
class Tally:
    """How often an interval was stated and held the truth, by instrument and kind of parameter."""

    stated: Counter[tuple[str, str]] = field(default_factory=Counter)
    held: Counter[tuple[str, str]] = field(default_factory=Counter)
    sessions: int = 0
    failed: int = 0

    def add(self, instrument: str, session: Session, fit: Fit, seen: Identifiability) -> None:
        """Every parameter with an interval against its truth."""
        self.sessions += 1
        found = [i for i in intervals(fit, seen, LEVEL) if i.why is None and i.name in session.truth]
        self.failed += not found
        for one in found:
            key = (instrument, kind(one.name))
            self.stated[key] += 1
            self.held[key] += one.low <= session.truth[one.name] <= one.high

    def share(self) -> float:
        """Of all stated intervals, how many held the truth."""
        return sum(self.held.values()) / sum(self.stated.values())


def kind(name: str) -> str:
    """'link3.offset' -> 'link offset'."""
    owner, _, what = name.partition(".")
    return f"{owner.rstrip('0123456789')} {what}"


def run(rig_file: Path, sessions: int = 1000, seed: int = 40_000) -> Tally:
    """Tracker and dual-PSD sessions in turn, that many in all, each with a truth of its own."""
    bench, rng, tally = Bench(rig_file), np.random.default_rng(seed), Tally()
    rig = load_rig(rig_file)
    tracker = SensorChain(arm_of(rig), Position(Target(TARGET_M), Device(transform(*T_BASE_DEVICE))))
    for number in range(sessions):
        if number % 2 == 0:
            session = bench.tracker(rng)
            tally.add("tracker", session, *identified(tracker, session, POSITION_SIGMA_M))
        else:
            session = bench.dual_psd(rng)
            chain = dual_psd_chain(rig, session.placement, session.first_psd)
            tally.add("dual PSD", session, *identified(chain, session, SPOT_SIGMA_M))
    return tally


def identified(chain: SensorChain, session: Session, sigma_m: float) -> tuple[Fit, Identifiability]:
    """Fit, and again with what the data do not see there removed, until that stands (in two rounds, seldom three)."""
    n, k = session.observed.shape
    whitener = np.tile(np.eye(k) / sigma_m, (n, 1, 1))
    problem = Problem(chain, chain.parameters, session.q_rad, session.observed, whitener)
    fit = solve(problem)
    seen = analyse(problem.jacobian(fit.theta), chain.parameters)
    for _ in range(4):
        kept = problem.with_parameters(reduced(chain.parameters, seen))
        fit = solve(kept, damping=NEAR_START, start=_nominal_where_held(fit, kept))
        seen = analyse(problem.jacobian(fit.theta), chain.parameters)
        if reduced(chain.parameters, seen) == kept.parameters:
            break
    return fit, analyse_along(problem, fit.theta, chain.parameters)


def _nominal_where_held(fit: Fit, kept: Problem) -> np.ndarray:
    return np.array([t if p.free else p.start for t, p in zip(fit.theta, kept.parameters, strict=True)])


def lines(tally: Tally) -> list[str]:
    """A line a kind, with the range that chance alone allows (99 %), and the sum."""
    out = [f"{'instrument':10s} {'parameter':18s} {'intervals':>9s} {'held':>7s}   by chance"]
    for key in sorted(tally.stated):
        n, share = tally.stated[key], tally.held[key] / tally.stated[key]
        low, high = binom.ppf([0.005, 0.995], n, LEVEL) / n
        out.append(f"{key[0]:10s} {key[1]:18s} {n:9d} {share:7.1%}   {low:.1%} to {high:.1%}")
    within = "within" if AIM[0] <= tally.share() <= AIM[1] else "OUTSIDE"
    out.append(
        f"{tally.sessions} sessions, {tally.failed} without any interval: {tally.share():.2%} of the 95 % intervals "
        f"hold the truth, {within} {AIM[0]:.0%} to {AIM[1]:.0%}"
    )
    return out
