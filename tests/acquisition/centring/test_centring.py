"""Centring: the laws of the loop, and every strategy from a wrong guess of the fixture pose."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from acquisition.bench import Look, Spot
from acquisition.centring.loop import CentringStatus, Limits, Proposal, centre
from acquisition.centring.registered import FixedGuess, Registered
from acquisition.centring.strategies import MeasuredStrategy
from benchmarks.centring import random_start
from benchmarks.centring import run as benchmark


class Plane:
    """A bench whose four spot coordinates are the first four joints times 0.1 m; light only within +-10 mm."""

    def __init__(self, q_rad: np.ndarray) -> None:
        self.q_rad, self.moves = q_rad, []

    def move(self, q_rad: np.ndarray) -> None:
        self.q_rad = q_rad
        self.moves.append(q_rad)

    def look(self, dwell_s: float) -> Look:
        spots = 0.1 * self.q_rad[:4]
        lit = [bool(np.all(np.abs(spots[2 * k : 2 * k + 2]) <= 0.01)) for k in range(2)]
        faces = [
            Spot(*(spots[2 * k : 2 * k + 2] if lit[k] else (np.nan, np.nan)), 1.0, 1e-7, 1e-7, lit=lit[k])
            for k in range(2)
        ]
        return Look(0.0, 0.0, self.q_rad, np.zeros(6), self.q_rad, None, {}, True, faces[0], faces[1])


class Wide:
    lower_rad, upper_rad = np.full(6, -3.0), np.full(6, 3.0)


class Stubborn:
    """A strategy that always proposes the same step."""

    name = "stubborn"

    def __init__(self, step_rad: np.ndarray) -> None:
        self.step_rad, self.learned = step_rad, []

    def learn(self, q_rad: np.ndarray, spots_m: np.ndarray) -> None:
        self.learned.append(spots_m)

    def propose(self, target_m: np.ndarray) -> Proposal:
        return Proposal(self.step_rad, "correct")


ONE = np.array([1.0, 0, 0, 0, 0, 0])


def test_already_centred_takes_no_motion() -> None:
    bench = Plane(np.zeros(6))
    run = centre(bench, Wide(), Stubborn(ONE), np.zeros(6), np.zeros(4))
    assert run.status is CentringStatus.CENTRED
    assert run.steps == 0
    assert bench.moves == []


def test_no_light_at_the_start_is_said() -> None:
    run = centre(Plane(0.5 * ONE), Wide(), Stubborn(ONE), 0.5 * ONE, np.zeros(4))
    assert run.status is CentringStatus.NO_LIGHT


def test_a_step_that_loses_the_light_is_halved_until_it_is_back() -> None:
    strategy = Stubborn(0.16 * ONE)
    run = centre(Plane(np.zeros(6) + 0.05 * ONE), Wide(), strategy, 0.05 * ONE, np.zeros(4), Limits(max_steps=3))
    purposes = [step.purpose for step in run.trace]
    assert purposes[:4] == ["start", "correct", "go back", "go back"]
    assert np.isfinite(strategy.learned).all()  # a dark reading teaches nothing


def test_after_a_loss_the_next_step_keeps_the_light() -> None:
    """A strategy that knows nothing: every step of its own length leads across the whole face."""

    class Overshooting(Stubborn):
        def propose(self, target_m: np.ndarray) -> Proposal:
            return Proposal(0.16 * np.roll(ONE, len(self.learned) % 2), "correct")

    start = 0.05 * ONE
    run = centre(Plane(start), Wide(), Overshooting(ONE), start, np.full(4, 1.0), Limits(max_steps=3))
    assert [bool(np.isfinite(step.spots_m).all()) for step in run.trace] == [True, False, True, True]
    assert run.losses == 1


def test_a_light_that_does_not_come_back_is_said_and_the_last_look_is_dark() -> None:
    class Blown(Plane):
        def look(self, dwell_s: float) -> Look:
            look = super().look(dwell_s)
            dark = Spot(np.nan, np.nan, 0.0, np.nan, np.nan, lit=False)
            return dataclasses.replace(look, psd1=dark) if self.moves else look

    start = 0.05 * ONE
    run = centre(Blown(start), Wide(), Stubborn(0.01 * ONE), start, np.zeros(4))
    assert run.status is CentringStatus.SPOT_LOST
    assert not run.look.psd1.lit


def test_the_largest_joint_step_is_the_limit() -> None:
    bench = Plane(np.zeros(6))
    centre(bench, Wide(), Stubborn(0.09 * ONE), np.zeros(6), np.full(4, 1.0), Limits(step_rad=0.01, max_steps=2))
    assert np.max(np.abs(bench.moves[0])) == pytest.approx(0.01)


def test_a_step_out_of_the_joint_range_is_not_taken() -> None:
    class Narrow:
        lower_rad, upper_rad = np.full(6, -0.05), np.full(6, 0.05)

    bench = Plane(np.zeros(6))
    run = centre(bench, Narrow(), Stubborn(0.09 * ONE), np.zeros(6), np.full(4, 1.0))
    assert run.status is CentringStatus.JOINT_LIMIT
    assert bench.moves == []


def test_steps_run_out() -> None:
    run = centre(Plane(np.zeros(6)), Wide(), Stubborn(1e-4 * ONE), np.zeros(6), np.full(4, 1.0), Limits(max_steps=7))
    assert run.status is CentringStatus.OUT_OF_STEPS
    assert run.steps == 7


def test_a_tolerance_below_the_repeatability_ends_in_a_named_limit_cycle() -> None:
    class Jumpy(Stubborn):
        def propose(self, target_m: np.ndarray) -> Proposal:
            self.step_rad = -self.step_rad
            return Proposal(self.step_rad, "correct")

    start = 2e-5 * ONE
    run = centre(Plane(start), Wide(), Jumpy(4e-5 * ONE), start, np.zeros(4), Limits(tolerance_m=1e-6))
    assert run.status is CentringStatus.LIMIT_CYCLE


STRATEGIES: dict[str, Callable] = {"registered": Registered, "measured": MeasuredStrategy}


@pytest.mark.parametrize("name", STRATEGIES)
@pytest.mark.parametrize("case", [0, 1])
def test_reaches_5_um_with_the_fixture_pose_wrong_by_up_to_80_deg_and_50_mm(
    rig, plain_rig, name: str, case: int
) -> None:
    start = random_start(rig, plain_rig, case, np.random.default_rng(700 + case))
    strategy = STRATEGIES[name](start.learner.arm, start.learner.optics, start.T_guess, start.first)
    run = centre(start.bench, start.learner.arm, strategy, start.q_rad, np.zeros(4))
    assert run.status is CentringStatus.CENTRED
    assert np.max(np.abs(run.look.spots_m())) <= 5e-6


@pytest.mark.parametrize("first", [1, 2])
def test_law_8_with_a_guess_wrong_by_25_deg_converges_with_ripple(rig, plain_rig, first: int) -> None:
    start = random_start(rig, plain_rig, first - 1, np.random.default_rng(40 + first), turn_rad=np.deg2rad(25.0))
    strategy = FixedGuess(start.learner.arm, start.learner.optics, start.T_guess, first, gain=0.6)
    run = centre(start.bench, start.learner.arm, strategy, start.q_rad, np.zeros(4), Limits(max_steps=60))
    assert run.status is CentringStatus.CENTRED


@pytest.mark.endure  # hundreds of starts; daily: those below
def test_centring_from_anywhere_keeps_its_promise(rig, plain_rig) -> None:
    """The benchmark in small: 10 random starts, fixture pose wrong by up to 80 deg and 50 mm, both orders."""
    runs = benchmark(rig, plain_rig, cases=range(10), seed=77, strategies=("registered (sessions use it)",))
    assert max(run.losses for run in runs["registered (sessions use it)"]) <= 1
    steps = [run.steps for run in runs["registered (sessions use it)"] if run.status is CentringStatus.CENTRED]
    assert len(steps) == 10
    assert np.median(steps) <= 6
