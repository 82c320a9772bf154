"""What a candidate is worth is told at its best inner values, and equal ones stay in the catalogue's order."""

from dataclasses import replace

import numpy as np

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.growing import proposals


def slips(session):
    return [t for t in session.candidates() if t.physics == "encoder-slip"]


def slipped_between_two_times_of_the_grid(world):
    rng = np.random.default_rng(5)
    session = world.session(rng)
    grid = np.array(slips(session)[1].inner[0].grid)
    at_s = float(grid[12] + 0.5 * (grid[13] - grid[12]))
    return world.session(np.random.default_rng(5), [(world.at_joint(2, lambda d: d.t_s > at_s), 2.0)]), at_s


def test_a_step_between_two_times_of_the_grid_is_worth_what_its_own_time_gives(world):
    session, at_s = slipped_between_two_times_of_the_grid(world)
    bench = Bench(session)
    first = next(iter(proposals(bench, bench.scores, None, 0.0, frozenset())))
    assert first.term.physics == "encoder-slip"
    assert first.term.port.where == "joint2.angle"
    assert abs(first.accepted.inner[0] - at_s) <= np.diff(session.drivers.t_s).max()
    assert first.gain > bench.scores.gain[first.entry] + 1.0


def test_of_two_equal_candidates_the_catalogue_s_first_is_proposed_first(world):
    session, _ = slipped_between_two_times_of_the_grid(world)
    twins = [replace(t, physics="latency") for t in slips(session)]
    for wanted, terms in (("encoder-slip", (*session.terms, *twins)), ("latency", (*twins, *session.terms))):
        bench = Bench(replace(session, terms=terms))
        found = list(proposals(bench, bench.scores, None, 0.0, frozenset()))
        assert found[0].term.physics == wanted
        assert np.isclose(found[0].gain, found[1].gain)
        assert found[0].term.physics != found[1].term.physics


def test_what_is_barred_or_worth_less_than_asked_is_not_proposed(world):
    session, _ = slipped_between_two_times_of_the_grid(world)
    bench = Bench(session)
    best = next(iter(proposals(bench, bench.scores, None, 0.0, frozenset())))
    others = list(proposals(bench, bench.scores, None, 0.0, frozenset({best.term.key})))
    assert all(p.term.key != best.term.key for p in others)
    assert not list(proposals(bench, bench.scores, None, best.gain + 1.0, frozenset()))
