"""Steps and drifts: found behind robust weights, told from each other, and gone where the arm came back to a pose."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.pruning import fading
from calibrate.diagnose.search.search import search, with_untrusted_step
from calibrate.diagnose.search.searching import Search
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.effects.time_laws import BEHIND, FOR_A_WHILE
from tests.calibrate.diagnose.concealed import recording_of


def slip(session, joint):
    return next(
        t for t in session.candidates() if t.physics == "encoder-slip" and t.port.where == f"joint{joint}.angle"
    )


def slipped_for_ten_shots(world, rng, sigmas=25.0):
    session = world.session(rng)
    late = (np.arange(len(session.drivers.t_s)) >= len(session.drivers.t_s) - 10).astype(float)
    effect = session.lever[:, :, 1] * late[:, None]
    return world.with_readings(session, session.readings + sigmas * effect / np.sqrt(np.mean(effect[-10:] ** 2)))


def test_a_step_over_ten_shots_is_found_though_robust_weights_swallow_it(world):
    found = 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        session = slipped_for_ten_shots(world, rng)
        assert session.distrusted >= 8
        end = search(session, rng).state
        found += [a.term.key for a in end.accepted] == [slip(session, 2).key] and end.distrusted <= 2
    assert found == 3


def test_trusted_again_outlying_rows_propose_the_step(world):
    rng = np.random.default_rng(3)
    session = slipped_for_ten_shots(world, rng)
    found = with_untrusted_step(Search(Bench(session), rng))
    assert found is not None
    (slipped,) = found.state.accepted
    assert slipped.term.key == slip(session, 2).key
    assert slipped.inner[0] == pytest.approx(session.drivers.t_s[-10], abs=np.diff(session.drivers.t_s)[-12:].max())


def test_scattered_outlying_rows_are_no_step(world):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        session = world.session(rng)
        outlying = rng.choice(len(session.readings), 10, replace=False)
        readings = session.readings.copy()
        readings[outlying] += 25.0 * rng.choice([-1.0, 1.0], (10, readings.shape[1]))
        assert with_untrusted_step(Search(Bench(world.with_readings(session, readings)), rng)) is None


@pytest.mark.parametrize(
    ("family", "seed", "hidden", "physics", "variant"),
    [
        ("cones", 5, "briefly-shifted-base", "base-moved", FOR_A_WHILE),
        ("cones", 5, "bumped-base", "base-moved", ""),
        ("dual-psd", 5, "briefly-shifted-laser", "laser-moved", FOR_A_WHILE),
        ("tracker", 1, "lagging-link", "link-thermal-growth", BEHIND),
        ("tracker", 1, "heated-link", "link-thermal-growth", ""),
    ],
)
def test_what_came_back_or_came_late_is_distinguished_from_what_did_not(
    tmp_path, family, seed, hidden, physics, variant
):
    recording = recording_of(tmp_path, family=family, seed=seed, samples=120, defects=(hidden,), enr=3.0)
    state = fit_geometry(session_of(recording.rig, recording.samples))
    [found] = search(state, np.random.default_rng(1)).state.accepted
    assert (found.term.physics, found.term.variant) == (physics, variant)


@pytest.mark.parametrize(
    ("physics", "shape"),
    [
        ("encoder-slip", lambda d: d.t_s > 0.4 * d.t_s.max()),
        ("link-thermal-growth", lambda d: 1.0 - np.exp(-d.t_s / (0.3 * d.t_s.max()))),
    ],
)
def test_a_step_and_a_drift_with_as_many_numbers_beat_each_other_where_they_are_true(world, physics, shape):
    right = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        found = search(world.session(rng, [(world.at_joint(3, shape), 1.0)]), rng)
        right += {a.term.physics for a in found.state.accepted} == {physics}
    assert right == 8


def drifting(world, rng, comes_back):
    """A joint that drifts; `comes_back`: visits of one pose show it, or read as if nothing had drifted."""
    session = world.session(rng)
    t, repeat = session.drivers.t_s, session.drivers.repeat.copy()
    drift = 12.0 * (1.0 - np.exp(-t / (0.3 * t.max())))
    if not comes_back:
        drift = np.where(repeat >= 0, 0.0, drift)
    return world.with_readings(session, session.readings + session.lever[:, :, 2] * drift[:, None])


def with_growth(session):
    term = next(
        t for t in session.candidates() if t.physics == "link-thermal-growth" and t.port.where == "joint3.angle"
    )
    return Bench(session.refitted([refined(Bench(session), term, np.array([0.3 * session.drivers.t_s.max()]))]))


def test_a_drift_has_to_be_there_between_visits_of_one_pose(world):
    rng = np.random.default_rng(1)
    assert fading(with_growth(drifting(world, rng, comes_back=True))) == []
    assert fading(with_growth(drifting(world, rng, comes_back=False))) == [0]


def test_without_visits_of_one_pose_a_drift_is_not_judged_by_them(world):
    session = drifting(world, np.random.default_rng(1), comes_back=False)
    drivers = replace(session.drivers, repeat=None)
    assert fading(with_growth(replace(session, drivers=drivers))) == []
