"""Guided sessions on the emulated hand without wires: slips are found, the arm is identified, and verified."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.guided.plan import GuidedOptions, calibration_plan
from acquisition.guided.reading import BarEnd, Cone, Reading
from acquisition.guided.session import GuidedSession, GuidedSummary
from acquisition.recording.rig import load_rig, plain_rig, rig_sha256, rig_text
from benchmarks.direct_hand import DirectHand
from calibeam.guided.judge import FittedJudge, samples_of
from calibeam.guided.recorded import AssumedGuidedArm
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.record import record_of
from calibrate.fit.solvers import Status
from calibrate.model.model_file import RigIdentity
from calibrate.model.predict import Predictor
from simulators.hand.world import HandWorld

RIG_FILE = Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml"
RIG, TEXT = load_rig(RIG_FILE), rig_text(RIG_FILE)
PLAIN = plain_rig(TEXT, str(RIG_FILE))


class Journal:
    def __init__(self) -> None:
        self.kinds: list[str] = []

    def readings(self, readings) -> None: ...

    def event(self, kind, detail) -> None:
        self.kinds.append(kind)


def world(seed: int, **emulation: float) -> HandWorld:
    return HandWorld.from_rig({**PLAIN, "emulation": {**PLAIN["emulation"], **emulation}}, seed=seed)


def session(hand: DirectHand, plan) -> tuple[GuidedSummary, Journal]:
    journal = Journal()
    made = GuidedSession(
        hand, AssumedGuidedArm.of_rig(RIG), hand, FittedJudge(RIG), journal, np.random.default_rng(1), patience_s=30.0
    )
    return made.run(plan), journal


@pytest.fixture(scope="module")
def taken() -> tuple[HandWorld, GuidedSummary, Journal]:
    """A small session of an arm whose hand slips one time in eight."""
    made = world(3, slip_share=0.12)
    summary, journal = session(DirectHand(made, 0.05), calibration_plan(RIG, GuidedOptions(postures=7, lengths=1)))
    return made, summary, journal


@pytest.fixture(scope="module")
def judge(taken) -> FittedJudge:
    """Who has learned all of it."""
    made = FittedJudge(RIG)
    made.learn(taken[1].readings)
    return made


def reading(q_rad, target=Cone(1, (0.5, 0.1, 0.0))) -> Reading:  # noqa: B008 - frozen record
    return Reading(target, np.asarray(q_rad, dtype=float), 0.0, 0.0)


def true_place_m(made: HandWorld, one: Reading) -> np.ndarray:
    """Where the true arm has its probe at this reading, graduation and noise aside."""
    shaft = one.q_rad.copy()
    for _ in range(3):
        shaft = one.q_rad - made.arm.discs.off_centre_rad(shaft[None])[0]
    return made.arm.tip_m(shaft[None])[0]


def test_what_is_kept_was_in_its_seat(taken) -> None:
    made, summary, journal = taken
    seats = {seat.id: np.array(seat.origin_m) for seat in made.truth.seats}
    off = [
        np.linalg.norm(true_place_m(made, one) - seats[one.target.id])
        for one in summary.readings
        if isinstance(one.target, Cone)
    ]
    assert summary.slips >= 2
    assert "slip" in journal.kinds
    assert np.mean(np.array(off) > 1e-4) <= 0.1  # of the first ones nobody can tell: the identification leaves them out


def test_the_arm_is_identified_to_micrometres_and_its_discs_with_it(taken) -> None:
    made, summary, _ = taken
    samples = samples_of(summary.readings, 6)
    found = identify(RIG, samples, rng=np.random.default_rng(1), held_out_share=0.0)
    assert found.status in (Status.CONVERGED, Status.RANK_DEFICIENT)
    assert not any("no length" in alarm for alarm in found.alarms)
    model = record_of(found, RigIdentity(RIG.name, rig_sha256(TEXT), TEXT), "local-poe")
    rng = np.random.default_rng(2)
    shafts = np.array([one.q_rad for one in summary.readings]) + rng.normal(0, 0.05, (len(summary.readings), 6))
    tips = Predictor.of(model).tip_m(shafts + made.arm.discs.off_centre_rad(shafts))
    true = made.arm.tip_m(shafts)
    spans = np.linalg.norm(tips[:, None] - tips[None], axis=2) - np.linalg.norm(true[:, None] - true[None], axis=2)
    assert np.sqrt(np.mean(spans**2)) < 15e-6
    drawn = AssumedGuidedArm.of_rig(RIG).tip_m(shafts)
    before = np.linalg.norm(drawn[:, None] - drawn[None], axis=2) - np.linalg.norm(true[:, None] - true[None], axis=2)
    assert np.sqrt(np.mean(before**2)) > 200e-6
    sizes = {p.name: p for p in found.estimates if "disc" in p.name}
    disc = made.truth.discs[2]
    estimate = sizes["joint3.disc_sine"]
    assert estimate.value is not None
    expected = disc.eccentricity_m / 0.02 * np.cos(disc.bearing_rad)
    assert abs(estimate.value - expected) < 5.0 * estimate.sigma + 3e-6


def test_cones_alone_say_that_the_size_of_the_arm_is_only_assumed(taken) -> None:
    """All lengths times a factor satisfy every cone: without a length the drawing alone holds the scale."""
    _, summary, _ = taken
    cones = tuple(one for one in summary.readings if isinstance(one.target, Cone))
    found = identify(RIG, samples_of(cones, 6), rng=np.random.default_rng(1), held_out_share=0.0)
    assert any("cones alone determine no length" in alarm for alarm in found.alarms)


def test_a_reading_off_its_cone_is_uncertain_once_the_arm_is_known(taken, judge) -> None:
    _, summary, _ = taken
    last = [one for one in summary.readings if isinstance(one.target, Cone)][-1]
    assert judge.off_target([last]) is None
    pushed = reading(np.add(last.q_rad, [0, 5e-4, 0, 0, 0, 0]), last.target)
    assert judge.off_target([pushed]).miss_m > 1e-4
    assert judge.repeatability_m < 20e-6


def test_a_bar_of_another_length_is_uncertain(taken, judge) -> None:
    _, summary, _ = taken
    ends = [one for one in summary.readings if isinstance(one.target, BarEnd)][:2]
    assert judge.off_target(ends) is None
    longer = reading(np.add(ends[1].q_rad, [5e-4, 0, 0, 0, 0, 0]), ends[1].target)
    assert judge.off_target([ends[0], longer]) is not None


def test_before_anything_is_known_nothing_is_uncertain() -> None:
    judge = FittedJudge(RIG)
    assert judge.off_target([reading([0.1] * 6)]) is None
    assert judge.repeatability_m is None


def test_postures_bring_the_assumed_probe_there_within_the_ranges() -> None:
    arm = AssumedGuidedArm.of_rig(RIG)
    starts = np.random.default_rng(1).uniform(arm.lower_rad, arm.upper_rad, (60, 6))
    found = arm.postures(starts, np.array([0.5, 0.1, 0.2]))
    assert len(found) > 10
    np.testing.assert_allclose(arm.tip_m(found), np.tile([0.5, 0.1, 0.2], (len(found), 1)), atol=1e-5)
    assert np.all((found >= arm.lower_rad) & (found <= arm.upper_rad))
    assert len(arm.postures(starts[:4], np.array([5.0, 0.0, 0.0]))) == 0
