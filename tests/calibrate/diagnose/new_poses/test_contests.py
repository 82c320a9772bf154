"""The next poses, judged by readings that mechanisms made: they part truth and rival more than random poses do."""

import json

import numpy as np
import pytest

from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.new_poses.contests import duel, rival_named
from calibrate.diagnose.new_poses.longer_session import NewPoses, at_new_poses
from calibrate.diagnose.new_poses.next_poses import next_poses
from calibrate.diagnose.new_poses.reachable import reachable
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.score import scores
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from tests.calibrate.diagnose.concealed import recording_of

MEASURED, RANDOM = 60, 2


def advice_of(folder):
    """What was hidden: to judge, never to diagnose."""
    return json.loads((folder / "sealed" / "truth.json").read_text())["defects"][0]


def with_term(state, physics, where):
    """The state with the best term of a name."""
    bench = Bench(state)
    gain = bench.scores.gain
    mine = [
        e
        for e, entry in enumerate(bench.menu.entries)
        if (bench.menu.terms[entry.term].physics, bench.menu.terms[entry.term].port.where) == (physics, where)
    ]
    best = bench.menu.entries[max(mine, key=lambda e: gain[e])]
    return state.refitted([refined(bench, bench.menu.terms[best.term], best.inner)])


def nearest_rival(state):
    """Of another place or another physics."""
    bench, own = Bench(state), state.accepted[0].term
    for entry in np.argsort(-scores(bench.menu, bench.gone[0]).gain):
        term = bench.menu.terms[bench.menu.entries[entry].term]
        if (term.physics, term.port.where) != (own.physics, own.port.where):
            return rival_named(state, 0, named(term))
    raise AssertionError("nothing else is in the catalogue")


def margin(recording, rows, truth, rival):
    """BIC by which the truth is better, both refitted to these rows."""
    state = fit_geometry(session_of(recording.rig, recording.samples.take(np.sort(rows))))
    bench = Bench(state)
    terms = {term.key: term for term in bench.menu.terms}
    return np.subtract(
        *(Bench(state.refitted([refined(bench, terms[a.term.key], a.inner)])).bic for a in (rival, truth))
    )


def poses_like(recording, measured, rest, rng):
    samples = recording.samples
    place = np.stack([samples.integers(c, 0) for c in ("placement", "first_psd")], axis=1)
    like = [rng.choice(np.flatnonzero((place[measured] == place[row]).all(axis=1))) for row in rest]
    q_rad = samples.joints()
    return NewPoses(q_rad[rest], np.where(q_rad[rest] > q_rad[rest - 1], 1.0, -1.0), np.array(like))


@pytest.mark.parametrize(
    ("seed", "kind", "physics"),
    [
        pytest.param(35, "worn-bearing", "axis-wobble", marks=pytest.mark.endure),
        (34, "soft-joint", "joint-compliance"),
        pytest.param(43, "psd-gain", "psd-gain", marks=pytest.mark.endure),
    ],
)
def test_twenty_chosen_poses_part_truth_and_rival_more_than_random_ones(seed, kind, physics, tmp_path):
    wanted = {"family": "dual-psd", "seed": seed, "defects": (kind,), "enr": 0.6, "samples": 300}
    recording, rng = recording_of(tmp_path, **wanted), np.random.default_rng(seed)
    where = advice_of(tmp_path)["port"]
    order = rng.permutation(len(recording.samples))
    measured, rest = np.sort(order[:MEASURED]), np.sort(order[MEASURED:])
    state = fit_geometry(session_of(recording.rig, recording.samples.take(measured)))
    state = with_term(state, physics, where)
    rival = nearest_rival(state)
    there = at_new_poses(state, poses_like(recording, measured, rest, rng))
    chosen = rest[next_poses([duel(there, 0, rival)]).poses]
    truth = state.accepted[0]
    by_chance = [
        margin(recording, np.concatenate([measured, rng.choice(rest, 20, replace=False)]), truth, rival)
        for _ in range(RANDOM)
    ]
    assert margin(recording, np.concatenate([measured, chosen]), truth, rival) > np.mean(by_chance)


def test_poses_that_could_be_taken_land_where_the_model_sees_them(tmp_path):
    """Spots on both faces, angles within limits, and most of them poses that nobody took."""
    recording = recording_of(tmp_path, family="dual-psd", seed=51, samples=80)
    state = fit_geometry(session_of(recording.rig, recording.samples))
    offered = reachable(state, np.random.default_rng(1), 100)
    there = at_new_poses(state, offered)
    spots_m = there.around.expected[0][len(recording.samples) :]
    assert len(offered) > 60
    assert np.max(np.abs(spots_m)) < recording.rig.fixture.half_size_m
    limits = np.array([(j.lower_rad, j.upper_rad) for j in recording.rig.arm.joints])
    assert np.all((offered.q_rad >= limits[:, 0]) & (offered.q_rad <= limits[:, 1]))
    assert np.median(np.abs(offered.q_rad - recording.samples.joints()[offered.like]).max(axis=1)) > 0.05


def test_a_probe_stays_in_its_cone(tmp_path):
    recording = recording_of(tmp_path, family="cones", seed=52, samples=80)
    state = fit_geometry(session_of(recording.rig, recording.samples))
    there = at_new_poses(state, reachable(state, np.random.default_rng(1), 60))
    seat = next(i for i, m in enumerate(there.session.measured) if m.name == "seat")
    rows = there.session.measured[seat].sample_rows[:, -1] >= len(recording.samples)
    assert rows.sum() > 20
    recorded = np.isin(there.session.samples.column("q1_rad"), recording.samples.column("q1_rad"))
    landed = ~recorded[there.session.measured[seat].sample_rows[rows, -1]]
    assert landed.sum() > 10
    assert np.max(np.abs(there.around.expected[seat][rows][landed])) < 1e-5
