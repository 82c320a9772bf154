"""A whole session on the in-process bench: what it takes, and how it meets trouble."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from acquisition.bench import Look
from acquisition.centring.navigator import GLANCE_S
from acquisition.centring.strategies import CentringBy, CentringChoice
from acquisition.errors import NoLightError, RefusedMotionError
from acquisition.session.plan import PlanOptions, blocks
from acquisition.session.records import Phase, Sample
from acquisition.session.session import Session
from acquisition.session.stepping import Summary
from calibeam.learner import FittedLearner
from drivers.errors import DeviceRefused
from tests.support.direct_bench import DirectBench, direct_bench

SMALL = PlanOptions(centred=2, off_centre=4, repeats=1)


class Kept:
    """A journal that keeps everything in memory."""

    def __init__(self) -> None:
        self.samples: list[Sample] = []
        self.events: list[tuple[str, Mapping[str, Any]]] = []

    def sample(self, sample: Sample) -> None:
        self.samples.append(sample)

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        self.events.append((kind, detail))


SMALLEST = PlanOptions(centred=1, off_centre=3, repeats=1, roll_rad=(-1.0, 1.0))
PLACES = (1, 2)  # of three: moving there and back adds nothing


def run(rig, bench, options: PlanOptions = SMALL) -> tuple[Summary, Kept]:
    kept = Kept()
    session = Session(bench, FittedLearner(rig), kept, options, np.array(rig.motion.home_rad))
    return session.run(PLACES), kept


@pytest.fixture(scope="module")
def taken(rig, plain_rig) -> tuple[Summary, Kept]:
    return run(rig, direct_bench(rig, plain_rig, seed=6))


def test_takes_every_place_in_both_orders(taken) -> None:
    pairs = {(sample.placement, sample.first) for sample in taken[0].samples}
    assert pairs == {(place, first) for place in PLACES for first in (1, 2)}
    assert taken[0].skipped == 0


def test_once_a_block_has_light_a_pose_takes_a_motion_or_two(taken) -> None:
    """The fixture pose is known from the poses before: the first step of the servo is a whole one."""
    assert np.median(taken[0].centring_steps[5:]) <= 2


def test_centred_poses_are_within_5_um(taken) -> None:
    centred = [sample.look.spots_m() for sample in taken[0].samples if sample.centred and sample.repeat is None]
    assert len(centred) == 8
    # The reading after the servo is a new one: 0.3 um of noise of the deciding look comes on top of the tolerance.
    assert np.max(np.abs(centred)) < 6e-6


@pytest.mark.parametrize("by", [CentringBy.MEASURED, pytest.param(CentringBy.LAW8, marks=pytest.mark.endure)])
def test_another_strategy_centres_as_well_and_the_recording_says_which(rig, plain_rig, by) -> None:
    few = PlanOptions(centred=2, off_centre=1, repeats=0, roll_rad=(-0.5, 0.5), centring=CentringChoice(by))
    kept = Kept()
    bench = direct_bench(rig, plain_rig, seed=6)
    summary = Session(bench, FittedLearner(rig), kept, few, np.array(rig.motion.home_rad)).run((1,))
    assert {detail["strategy"] for kind, detail in kept.events if kind == "centring"} == {by.value}
    fine = [detail for kind, detail in kept.events if kind == "centring" and detail["tolerance_m"] == 5e-6]
    assert len(fine) == 4 == sum(sample.centred for sample in summary.samples)
    for detail in fine:
        assert np.max(np.abs(np.array(detail["spots_m"][-1]) - detail["target_m"])) <= 5e-6


def test_off_centre_poses_spread_over_the_faces(taken) -> None:
    spots = np.array([sample.look.spots_m() for sample in taken[0].samples if not sample.centred])
    assert np.all(np.abs(spots) < 0.010)
    assert np.all(spots.std(axis=0) > 0.003)


def test_repeats_share_their_command_and_one_of_them_comes_from_the_other_side(taken) -> None:
    groups: dict[int, list[Sample]] = {}
    for sample in taken[0].samples:
        if sample.repeat is not None:
            groups.setdefault(sample.repeat, []).append(sample)
    assert len(groups) == 4
    for group in groups.values():
        first, again, opposite = group
        assert np.array_equal(first.look.cmd_rad, again.look.cmd_rad)
        assert np.array_equal(first.look.cmd_rad, opposite.look.cmd_rad)
        moved = first.approach != 0
        assert np.array_equal(again.approach[moved], first.approach[moved])
        assert np.array_equal(opposite.approach[moved], -first.approach[moved])


def test_a_row_has_the_columns_of_the_session_folder(taken) -> None:
    row = taken[0].samples[0].row()
    for name in (
        "t_s",
        "q6_rad",
        "placement",
        "first_psd",
        "psd1_x_m",
        "psd2_sum_v",
        "cmd1_rad",
        "enc6_rad",
        "approach1",
        "repeat",
        "qd1_rad_s",
        "temp_psd_degC",
        "temp_joint1_degC",
    ):
        assert name in row


def test_every_centring_run_is_in_the_journal_with_its_trace(taken) -> None:
    runs = [detail for kind, detail in taken[1].events if kind == "centring"]
    assert len(runs) >= 24
    for detail in runs:
        assert len(detail["spots_m"]) == len(detail["purpose"])
        assert detail["status"] == "CENTRED"


def test_no_fixture_is_light_lost_for_good(rig, bench_of) -> None:
    class Empty(DirectBench):
        def place_fixture(self, placement: int) -> None:
            self.world.place_fixture(0)

    bench = bench_of(1)
    with pytest.raises(NoLightError, match="check that the laser is on"):
        run(rig, Empty(bench.world, bench.half_size_m))


@pytest.mark.endure  # daily: without a fixture from the start, above
def test_a_fixture_taken_away_in_mid_session_is_light_lost_for_good(rig, bench_of) -> None:
    bench = bench_of(2)

    class Thief(Kept):
        def sample(self, sample: Sample) -> None:
            super().sample(sample)
            if len(self.samples) == 7:
                bench.world.place_fixture(0)

    kept = Thief()
    session = Session(bench, FittedLearner(rig), kept, SMALL, np.array(rig.motion.home_rad))
    with pytest.raises(NoLightError, match="check that the laser is on"):
        session.run(PLACES)
    assert len(kept.samples) == 7


def test_a_light_that_is_found_and_lost_at_once_ends_the_session_by_name(rig, bench_of) -> None:
    class OnlyGlances(DirectBench):
        """Light for the short looks of the search, none for the longer ones of the servo."""

        def look(self, dwell_s: float) -> Look:
            self.world.place_fixture(1 if dwell_s == GLANCE_S else 0)
            return super().look(dwell_s)

    bench = bench_of(2)
    with pytest.raises(NoLightError, match="light was found, but the light was lost"):
        run(rig, OnlyGlances(bench.world, bench.half_size_m))


def test_a_fixture_bumped_in_mid_session_is_found_again(rig, bench_of) -> None:
    bench = bench_of(2)
    bumped = 9
    bench.world._places[bumped] = bench.world._places[1]
    bench.world._faces_at[bumped] = tuple(
        dataclasses.replace(face, centre_m=(face.centre_m[0] + 0.015, *face.centre_m[1:]))
        for face in bench.world._faces_at[1]
    )

    class Bump(Kept):
        def sample(self, sample: Sample) -> None:
            super().sample(sample)
            if len(self.samples) == 3:
                bench.world.place_fixture(bumped)

    session = Session(bench, FittedLearner(rig), Bump(), SMALLEST, np.array(rig.motion.home_rad))
    assert len(session.run((1,)).samples) > 8


def test_a_protective_stop_in_mid_session_keeps_what_was_taken(rig, bench_of) -> None:
    class Stops(DirectBench):
        def move(self, q_rad: np.ndarray) -> None:
            if self.moves > 40:
                raise DeviceRefused("robot: protective stop")
            super().move(q_rad)

    bench, kept = bench_of(2), Kept()
    stopping = Stops(bench.world, bench.half_size_m)
    session = Session(stopping, FittedLearner(rig), kept, SMALL, np.array(rig.motion.home_rad))
    with pytest.raises(DeviceRefused):
        session.run(PLACES)
    assert len(kept.samples) > 5


def test_a_repeat_whose_way_is_not_free_is_left_out_and_the_session_goes_on(rig, bench_of) -> None:
    class Boxed:
        """Refuses the way to the first repeat."""

        def __init__(self, bench) -> None:
            self._bench, self.refused, self.refusing = bench, 0, False

        def move(self, q_rad) -> None:
            if self.refusing and not self.refused:
                self.refused += 1
                raise RefusedMotionError("the tool would come within 59 mm of the keep-out box 'table'")
            self._bench.move(q_rad)

        def __getattr__(self, name):
            return getattr(self._bench, name)

    bench, kept = Boxed(bench_of(2)), Kept()

    def tell(now) -> None:
        bench.refusing = now.phase is Phase.REPEAT

    session = Session(bench, FittedLearner(rig), kept, SMALLEST, np.array(rig.motion.home_rad), tell=tell)
    summary = session.run((1,))
    assert bench.refused == 1
    assert summary.skipped == 1
    assert [detail["why"] for kind, detail in kept.events if kind == "skipped"] == [
        "the tool would come within 59 mm of the keep-out box 'table'"
    ]
    assert sum(sample.repeat is not None for sample in summary.samples) > 0


def test_the_plan_takes_the_four_poses_of_the_source_at_every_place() -> None:
    plan = tuple(blocks((1, 2), 0.01, SMALL))
    assert [(block.placement, block.first) for block in plan] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    for block in plan:
        assert sum(visit.centred for visit in block.visits) >= 2


def test_the_plan_is_the_same_from_the_same_seed_only() -> None:
    one, two = (tuple(blocks((1,), 0.01, SMALL)) for _ in range(2))
    assert one == two
    assert one != tuple(blocks((1,), 0.01, dataclasses.replace(SMALL, seed=2)))
