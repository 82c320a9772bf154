"""Names that data cannot separate: the simplest one; names that they can: the better one."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.diagnose.assess.assessment import with_best_names
from calibrate.diagnose.assess.findings import findings_of
from calibrate.diagnose.assess.rivals import Rival, confidences
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.searching import Search
from calibrate.model.effects.term import Accepted, Shape


def named(session, where, physics):
    return next(t for t in session.candidates() if t.port.where == where and t.physics == physics)


def settled(session, term, rng):
    inner = np.array([spec.grid[1] for spec in term.inner])
    start = Bench(session.refitted([refined(Bench(session), term, inner)]))
    at, rivals = with_best_names(Search(start, rng, p={term.key: 0.002}))
    (found,) = at.state.accepted
    return found.term, at, rivals


@pytest.mark.parametrize(
    "more", [{"depends_on": ("approach2", "q1")}, {"order": 4}], ids=["another driver", "higher harmonic"]
)
def test_of_two_names_with_the_same_columns_the_simpler_is_reported_and_the_other_is_its_rival(world, more):
    rng = np.random.default_rng(1)
    session = world.session(rng, [(world.at_joint(2, lambda d: d.approach[:, 1]), 1.5)])
    simple = named(session, "joint2.angle", "backlash")
    twin = replace(simple, **more, physics="reading-lag")
    found, at, rivals = settled(replace(session, terms=(*session.terms, twin)), twin, rng)
    assert found.key == simple.key
    assert twin.key in {r.term.key for r in rivals[0]}
    assert at.p[simple.key] == 0.002


def test_the_better_name_takes_over_whatever_was_there_first(world):
    rng = np.random.default_rng(2)
    session = world.session(rng, [(world.at_joint(2, lambda d: np.sin(d.q_rad[:, 1])), 0.4)])
    right = named(session, "joint2.angle", "encoder-eccentricity")
    wrong = replace(right, shape=Shape.LINEAR, order=None, physics="gear-ratio-error")
    session = replace(session, terms=(*session.terms, wrong))
    bench = Bench(session)
    margin = Bench(session.refitted([refined(bench, wrong, np.zeros(0))])).bic
    margin -= Bench(session.refitted([refined(bench, right, np.zeros(0))])).bic
    assert margin > 2.0
    assert settled(session, wrong, rng)[0].key == right.key


def test_a_rival_is_within_six_of_bic(world):
    rng = np.random.default_rng(3)
    session = world.session(rng, [(world.at_joint(2, lambda d: np.sin(d.q_rad[:, 1])), 0.5)])
    _, _, rivals = settled(session, named(session, "joint2.angle", "encoder-eccentricity"), rng)
    assert all(r.margin <= 6.0 for r in rivals[0])


def test_time_and_a_temperature_that_follows_it_are_rivals_of_each_other(world):
    t = world.session(np.random.default_rng(4)).drivers.t_s
    warm = {"temp_room": 1.0 - np.exp(-t / (0.3 * t.max()))}
    truth = [(world.at_joint(3, lambda d: d.extra["temp_room"]), 1.5)]
    session = world.session(np.random.default_rng(4), truth, extra=warm)
    by_time = named(session, "joint3.angle", "link-thermal-growth")
    by_warmth = replace(by_time, depends_on=("temp_room",), shape=Shape.LINEAR, inner=(), slow=False)
    terms = (*(t for t in session.terms if t.depends_on != ("fan",)), by_warmth)
    for first in (by_time, by_warmth):
        _, at, rivals = settled(replace(session, terms=terms), first, np.random.default_rng(0))
        keys = {at.state.accepted[0].term.key, *(r.term.key for r in rivals[0])}
        assert {by_time.key, by_warmth.key} <= keys


def named_by(world, *rivals):
    """(1 + rival,) of a finding joint-compliance; `rivals` as physics, margin, whether a machine could be so."""
    session = world.session(np.random.default_rng(5), [])
    own = replace(named(session, "joint2.angle", "encoder-eccentricity"), physics="joint-compliance")
    others = [
        Rival(Accepted(replace(own, physics=p), np.ones(2), np.zeros(0)), margin, refitted=True, plausible=could)
        for p, margin, could in rivals
    ]
    return confidences(Bench(session), own, others)


def test_the_first_name_is_never_less_likely_than_another(world):
    own, better = named_by(world, ("backlash", -1.5, True))
    assert own == better == 0.5
    own, better = named_by(world, ("backlash", -9.0, False))
    assert own == better < 0.05


def test_of_names_that_fit_alike_the_softer_part_is_likelier(world):
    joint, base, link, tool = named_by(
        world, ("base-compliance", 0.0, True), ("link-bending", 0.0, True), ("tool-sag", 0.0, True)
    )
    assert joint == pytest.approx(2.0 * base)
    assert base == pytest.approx(2.0 * link)
    assert link == pytest.approx(2.0 * tool)


def test_a_name_that_nobody_believes_gives_way_to_an_unknown_cause(world):
    rng = np.random.default_rng(2)
    session = world.session(rng, [(world.at_joint(2, lambda d: np.sin(d.q_rad[:, 1])), 0.4)])
    _, at, _ = settled(session, named(session, "joint2.angle", "encoder-eccentricity"), rng)
    winner = Rival(at.state.accepted[0], -9.0, refitted=True, plausible=False)
    winner = replace(winner, accepted=replace(winner.accepted, term=replace(winner.term, physics="backlash")))
    for rivals, physics in (((), "encoder-eccentricity"), ((winner,), "unknown")):
        (found,) = findings_of(at, [rivals], np.ones(1))
        assert (found.name.where, found.name.physics) == ("joint2.angle", physics)
        assert not rivals or {r.name.physics for r in found.rivals} == {"encoder-eccentricity", "backlash"}
