"""Rivals, isolability, lack of fit, unrecorded drivers, proof, next poses."""

import numpy as np
import pytest

from calibrate.diagnose.assess.assessment import predicts
from calibrate.diagnose.assess.detection_limits import isolability
from calibrate.diagnose.assess.diagnosis import NAMED, UNKNOWN, Verdict
from calibrate.diagnose.assess.findings import findings_of
from calibrate.diagnose.assess.lack_of_fit import lack_of_fit
from calibrate.diagnose.assess.rivals import confidences, rivals_of
from calibrate.diagnose.assess.unrecorded import unrecorded
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.new_poses.next_poses import Contest, Duel, next_poses
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.search import search
from calibrate.diagnose.search.stated_sizes import sizes_of
from calibrate.model.effects.term import Size


def sine(joint):
    return lambda d: np.sin(d.q_rad[:, joint - 1] + 0.4)


def by_cause(session, where, physics, depends_on=None):
    return next(
        t
        for t in session.candidates()
        if t.port.where == where and t.physics == physics and depends_on in (None, t.depends_on)
    )


SHORT = (3.0, 2.5, 0.35, 3.0)


def test_shapes_on_a_short_sweep_are_rivals(world):
    """Over 20 degrees of joint 3, its first and second harmonic look alike."""
    seen = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        session = world.session(rng, [(world.at_joint(3, sine(3)), 0.7)], ranges=SHORT)
        bench = Bench(session)
        term = by_cause(session, "joint3.angle", "encoder-eccentricity")
        held = Bench(session.refitted([refined(bench, term, np.zeros(0))]))
        rivals = {(r.term.port.where, r.term.physics) for r in rivals_of(held, 0)}
        seen += ("joint3.angle", "encoder-harmonic") in rivals
    assert seen >= 7


def test_a_clear_effect_has_no_rivals_and_full_confidence(world):
    rng = np.random.default_rng(1)
    found = search(world.session(rng, [(world.at_joint(2, sine(2)), 2.0)]), rng)
    assert rivals_of(found.bench, 0) == ()
    (own,) = found.state.accepted
    assert confidences(found.bench, own.term, ()) == pytest.approx([1.0])


def test_isolability_is_one_for_the_same_shape_and_small_for_others(world):
    rng = np.random.default_rng(2)
    session = world.session(rng, ranges=SHORT)
    table = isolability(Bench(session).menu)
    at = {t.key: i for i, t in enumerate(table.terms)}
    first = at[by_cause(session, "joint3.angle", "encoder-eccentricity").key]
    second = at[by_cause(session, "joint3.angle", "encoder-harmonic").key]
    other = at[by_cause(session, "joint2.angle", "backlash").key]
    assert table.r2[first, first] == pytest.approx(1.0)
    assert table.r2[first, second] > 0.9
    assert table.r2[first, other] < 0.1


def test_lack_of_fit_is_seen_where_poses_repeat(world):
    rng = np.random.default_rng(3)
    assert not lack_of_fit(Bench(world.session(rng))).significant
    assert lack_of_fit(Bench(world.session(rng, [(world.at_joint(2, sine(2)), 2.0)]))).significant


def test_a_driver_that_was_not_recorded_is_seen_by_its_lever(world):
    right = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        hidden = np.random.default_rng(seed + 100)
        session = world.session(rng, [(world.at_joint(3, lambda d, h=hidden: h.normal(size=len(d.t_s))), 0.8)])
        right += diagnose(session, rng).verdict is Verdict.UNDECIDABLE
    assert right == 6


def test_instrument_noise_is_not_taken_for_an_unrecorded_driver(world):
    alarms = 0
    for seed in range(34):
        rng = np.random.default_rng(seed)
        alarms += unrecorded(Bench(world.session(rng)), rng) is not None
    assert alarms <= 2


def test_terms_that_are_there_predict_and_others_do_not(world):
    good, bad = [], []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        session = world.session(rng, [(world.at_joint(2, sine(2)), 0.6)])
        bench = Bench(session)
        there = refined(bench, by_cause(session, "joint2.angle", "encoder-eccentricity"), np.zeros(0))
        absent = refined(bench, by_cause(session, "joint4.angle", "axis-wobble", ("q1",)), np.zeros(0))
        wins = predicts(Bench(session.refitted([there, absent])))
        good.append(wins[0])
        bad.append(wins[1])
    assert min(good) > 20.0
    assert np.max(bad) < 10.0
    assert np.median(bad) < 3.0


def test_stated_sigmas_cover(world):
    """Truth: one coefficient of known size, 95 % intervals, 120 sessions."""
    inside = 0
    for seed in range(120):
        rng = np.random.default_rng(2000 + seed)
        session = world.session(rng)
        size = 0.3
        effect = np.einsum("nkj,nj->nk", session.lever, world.at_joint(2, lambda d: d.approach[:, 1])(session.drivers))
        moved = world.with_readings(session, session.readings + size * effect)
        term = by_cause(session, "joint2.angle", "backlash")
        bench = Bench(moved.refitted([refined(Bench(moved), term, np.zeros(0))]))
        (found,) = sizes_of(bench, 0).values()
        inside += abs(found.value - size) <= 1.96 * found.sigma
    assert inside / 120 == pytest.approx(0.95, abs=0.035)


def test_proof_reaches_the_floor(world):
    rng = np.random.default_rng(9)
    found = diagnose(world.session(rng, [(world.at_joint(2, sine(2)), 2.0)]), rng)
    assert found.verdict is Verdict.MISMATCH
    for proof in found.proofs:
        assert proof.rms_after_m < 1.25 * found.floors[0].rms_m < proof.rms_before_m
        assert 0.0 < proof.removed[0] < proof.removed[1] < 1.0


def test_nothing_hidden_is_consistent(world):
    rng = np.random.default_rng(10)
    found = diagnose(world.session(rng), rng)
    assert found.verdict is Verdict.CONSISTENT
    assert found.findings == ()
    assert found.rejected


def test_next_poses_separate_better_than_random_ones():
    """A sine against a line: only the ends of the sweep separate them."""
    rng = np.random.default_rng(11)
    q = rng.uniform(-0.5, 0.5, 100)
    offered = np.linspace(-2.0, 2.0, 81)
    X = np.stack([np.ones_like(q), q], axis=1)
    contest = Contest(np.sin(offered)[:, None], np.stack([np.ones_like(offered), offered], axis=1)[:, None, :])
    chosen = next_poses([Duel(X, np.sin(q), contest)], count=10)
    assert len(set(chosen.poses)) == 10
    assert np.min(np.abs(offered[chosen.poses])) > 0.5
    some = rng.choice(81, 10, replace=False)
    all_X, all_y = np.concatenate([X, contest.rival[some, 0]]), np.concatenate([np.sin(q), contest.finding[some, 0]])
    left = all_y - all_X @ np.linalg.lstsq(all_X, all_y, rcond=None)[0]
    assert chosen.separation[-1] > 2.0 * left @ left
    assert np.all(np.diff(chosen.separation) >= 0.0)


def test_no_confidence_exceeds_what_the_drawn_sessions_prove(world):
    rng = np.random.default_rng(1)
    found = diagnose(world.session(rng, [(world.at_joint(2, sine(2)), 5.0)]), rng)
    assert 0.9 < found.findings[0].confidence <= NAMED


@pytest.mark.parametrize(
    ("sizes", "is_a_name"),
    [
        ({"amplitude_rad": Size(59e-6, 23e-6)}, False),
        ({"amplitude_rad": Size(59e-6, 19e-6)}, True),
        ({"amplitude_rad": Size(59e-6, 23e-6), "phase_rad": Size(1.0, 0.1)}, False),  # where, not how much
        ({"x_m": Size(7.2e-6, 3.3e-6), "y_m": Size(-6.5e-6, 3.1e-6)}, True),  # together they may be plain
        ({"amplitude_rad": Size(59e-6, np.inf)}, True),  # not determined, and nothing is stated of it
    ],
)
def test_a_name_of_one_size_below_three_sigma_is_an_unknown_cause(world, monkeypatch, sizes, is_a_name):
    rng = np.random.default_rng(1)
    found = search(world.session(rng, [(world.at_joint(2, sine(2)), 2.0)]), rng)
    monkeypatch.setattr("calibrate.diagnose.assess.findings.sizes_of", lambda bench, i: sizes)
    (said,) = findings_of(found, [()], predicts(found.bench))
    assert (said.name.physics != UNKNOWN) is is_a_name
    assert said.confidence + sum(rival.confidence for rival in said.rivals) <= 1.0
    assert is_a_name or [rival.name.physics for rival in said.rivals] == ["encoder-eccentricity"]
