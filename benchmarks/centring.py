"""How many motions centring takes, and whether the search finds the light: distributions over random starts.

Each case is an emulated arm with zeros off by up to 2 deg and a fixture pose guessed wrong by up to 80 deg (or as
said) and 50 mm; both spots start somewhere on the faces, orders alternate. Every motion counts: probes and going back
too.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.centring.aim import AssumedArm, BeamTarget, FixtureOptics, flange_for, reach
from acquisition.centring.loop import Centring, CentringStatus, Limits, Strategy, centre
from acquisition.centring.registered import FixedGuess, Registered
from acquisition.centring.search import Found, Search
from acquisition.centring.strategies import MeasuredStrategy
from acquisition.errors import UnreachableError
from acquisition.recording.rig import Rig
from calibeam.learner import FittedLearner
from tests.support.direct_bench import DirectBench, direct_bench

Floats = NDArray[np.float64]
Make = Callable[[AssumedArm, FixtureOptics, Floats, int], Strategy]

SESSIONS = "registered (sessions use it)"
STRATEGIES: tuple[tuple[str, Make], ...] = (
    (SESSIONS, Registered),
    ("measured Jacobian, Broyden", MeasuredStrategy),
    ("law (8), gain 0.3", lambda arm, optics, T, first: FixedGuess(arm, optics, T, first, 0.3)),
    ("law (8), gain 0.5", lambda arm, optics, T, first: FixedGuess(arm, optics, T, first, 0.5)),
    ("law (8), gain 0.7", lambda arm, optics, T, first: FixedGuess(arm, optics, T, first, 0.7)),
    ("law (8), gain 1.0", lambda arm, optics, T, first: FixedGuess(arm, optics, T, first, 1.0)),
)
TURN_RAD = np.deg2rad(80.0)
SHIFT_M = 0.05
LIMITS = Limits(max_steps=100)


@dataclass(frozen=True)
class Start:
    """A pose with light on both faces, and the wrong guess of the fixture pose."""

    bench: DirectBench
    learner: FittedLearner
    q_rad: Floats
    T_guess: Floats
    first: int


def run(
    rig: Rig,
    plain_rig: Mapping[str, Any],
    cases: Sequence[int] = range(100),
    seed: int = 20_000,
    strategies: tuple[str, ...] = tuple(name for name, _ in STRATEGIES),
    turn_rad: float = TURN_RAD,
) -> dict[str, list[Centring]]:
    """Runs of the named strategies, all by default, from the same starts; the guess is off by up to `turn_rad`.

    `cases`: numbers of the starts. Each has its own draw, so that a run in parts has the starts of one in a piece.
    """
    runs: dict[str, list[Centring]] = {name: [] for name in strategies}
    for case in cases:
        start = random_start(rig, plain_rig, case, np.random.default_rng((seed, case)), turn_rad)
        for name, make in STRATEGIES:
            if name not in strategies:
                continue
            start.bench.move(start.q_rad)
            strategy = make(start.learner.arm, start.learner.optics, start.T_guess, start.first)
            runs[name].append(centre(start.bench, start.learner.arm, strategy, start.q_rad, np.zeros(4), LIMITS))
    return runs


def random_start(
    rig: Rig, plain_rig: Mapping[str, Any], case: int, rng: np.random.Generator, turn_rad: float = TURN_RAD
) -> Start:
    """Both spots anywhere on +-85 % of the faces; stand-off 0.1 to 0.3 m, any roll within +-150 deg."""
    first = 1 + case % 2
    while True:
        bench, learner = direct_bench(rig, plain_rig, seed=int(rng.integers(2**31))), FittedLearner(rig)
        placement = int(rng.choice(list(rig.placements)))
        bench.place_fixture(placement)
        edge_m = 0.85 * learner.optics.half_size_m
        spots = tuple(float(v) for v in rng.uniform(-edge_m, edge_m, 4))
        target = BeamTarget(first, spots, rng.uniform(0.1, 0.3), rng.uniform(-2.6, 2.6))
        T_true = true_fixture(bench, placement)
        q_rad = _stand(bench, learner, T_true, target, rng)
        if q_rad is not None:
            return Start(bench, learner, q_rad, _wrong(T_true, rng, turn_rad), first)


def true_fixture(bench: DirectBench, placement: int) -> Floats:
    """T_base_psd1 as it truly is."""
    pose = next(place.psd1_in_base for place in bench.world.truth.placements if place.id == placement)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(pose.rotation_rad).as_matrix()
    T[:3, 3] = pose.origin_m
    return T


def _stand(
    bench: DirectBench, learner: FittedLearner, T_true: Floats, target: BeamTarget, rng: np.random.Generator
) -> Floats | None:
    """Bring the spots near the target by search and servo with the true fixture pose; None where that fails."""
    arm, optics = learner.arm, learner.optics
    try:
        q_rad = reach(arm, flange_for(arm, optics, T_true, target), bench.standing_rad, rng)
    except UnreachableError:
        return None
    bench.move(q_rad)
    found = Search(bench, arm, optics, T_true, target.first).run(q_rad)
    if found.found is not Found.BOTH:
        return None
    strategy = Registered(arm, optics, T_true, target.first)
    stood = centre(bench, arm, strategy, found.q_rad, np.array(target.spots_m), Limits(tolerance_m=1e-3))
    return stood.trace[-1].q_rad if stood.status is CentringStatus.CENTRED else None


def _wrong(T_true: Floats, rng: np.random.Generator, turn_rad: float) -> Floats:
    axis, shift = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    T = T_true.copy()
    T[:3, :3] = Rotation.from_rotvec(axis * rng.uniform(0.0, turn_rad)).as_matrix() @ T_true[:3, :3]
    T[:3, 3] += shift * rng.uniform(0.0, SHIFT_M)
    return T


@dataclass(frozen=True)
class SearchRun:
    """One search from a pose without any light."""

    found: Found
    motions: int


def run_search(rig: Rig, plain_rig: Mapping[str, Any], cases: int = 100, seed: int = 30_000) -> list[SearchRun]:
    """Searches around the aim by the nominal rig, of worlds where that aim gives no light at all."""
    rng = np.random.default_rng(seed)
    runs: list[SearchRun] = []
    while len(runs) < cases:
        first = 1 + len(runs) % 2
        bench, learner = direct_bench(rig, plain_rig, seed=int(rng.integers(2**31))), FittedLearner(rig)
        placement = int(rng.choice(list(rig.placements)))
        bench.place_fixture(placement)
        T = learner.T_base_fixture(placement)
        target = BeamTarget(first, (0.0, 0.0, 0.0, 0.0), 0.2, rng.uniform(-2.6, 2.6))
        try:
            q_rad = reach(learner.arm, flange_for(learner.arm, learner.optics, T, target), bench.standing_rad, rng)
        except UnreachableError:
            continue
        bench.move(q_rad)
        look = bench.look(0.01)
        if look.psd1.lit or look.psd2.lit:
            continue
        result = Search(bench, learner.arm, learner.optics, T, first).run(q_rad)
        runs.append(SearchRun(result.found, result.motions))
    return runs


def lines(runs: Mapping[str, list[Centring]]) -> list[str]:
    """The distribution, one line a strategy."""
    out = ["strategy                        to 5 um   median   p90   max   motions: runs"]
    for name, results in runs.items():
        good = [run for run in results if run.status is CentringStatus.CENTRED]
        steps = np.array([run.steps for run in good]) if good else np.zeros(1)
        histogram = " ".join(f"{k}:{n}" for k, n in enumerate(np.bincount(steps.astype(int))) if n)
        out.append(
            f"{name:30s} {len(good):4d}/{len(results):<4d} {np.median(steps):6.0f} {np.percentile(steps, 90):5.0f} "
            f"{steps.max():5.0f}   {histogram}"
        )
        out.append(f"    light lost once in {_lost(results, 1)} runs, more often in {_lost(results, 2, more=True)}")
        ends = {run.status.name for run in results} - {CentringStatus.CENTRED.name}
        out += [f"    {status}: {sum(run.status.name == status for run in results)}" for status in sorted(ends)]
    return out


def _lost(results: list[Centring], times: int, *, more: bool = False) -> int:
    return sum(run.losses == times or (more and run.losses > times) for run in results)


def search_lines(runs: list[SearchRun]) -> list[str]:
    """How often and how fast the search found the light."""
    found = [run.motions for run in runs if run.found is Found.BOTH]
    return [
        f"search from no light: found {len(found)}/{len(runs)}, motions median {np.median(found):.0f}, "
        f"p90 {np.percentile(found, 90):.0f}, max {max(found)}"
    ]
