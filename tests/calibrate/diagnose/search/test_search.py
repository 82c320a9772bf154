"""What the search finds in sessions whose physics is known."""

import numpy as np
import pytest

from calibrate.diagnose.assess.unknown import with_unknowns
from calibrate.diagnose.search import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.search import search
from calibrate.diagnose.search.searching import Search


def sine(joint):
    return lambda d: np.sin(d.q_rad[:, joint - 1] + 0.4)


def names(found):
    return {(a.term.port.where, a.term.depends_on, a.term.physics) for a in found.state.accepted}


# Daily for one between: a smaller and a larger one.
@pytest.mark.parametrize("enr", [0.3, pytest.param(0.6, marks=pytest.mark.endure), 2.0])
def test_one_effect_is_found_and_named(world, enr):
    right = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        found = search(world.session(rng, [(world.at_joint(2, sine(2)), enr)]), rng)
        right += names(found) == {("joint2.angle", ("q2",), "encoder-eccentricity")}
    assert right >= 9


def test_three_effects_of_which_two_share_a_joint(world):
    right = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        truth = [
            (world.at_joint(2, sine(2)), 1.5),
            (world.at_joint(2, lambda d: d.approach[:, 1]), 0.6),
            (world.at_joint(3, lambda d: d.q_rad[:, 0]), 0.8),
        ]
        expected = {
            ("joint2.angle", ("q2",), "encoder-eccentricity"),
            ("joint2.angle", ("approach2",), "backlash"),
            ("joint3.angle", ("q1",), "joint-coupling"),
        }
        right += names(search(world.session(rng, truth), rng)) == expected
    assert right >= 9


def test_step_time_is_found_between_the_right_samples(world):
    rng = np.random.default_rng(4)
    session = world.session(rng, [(world.at_joint(1, lambda d: d.t_s > 2345.0), 1.0)])
    found = search(session, rng).state.accepted
    assert [a.term.physics for a in found] == ["encoder-slip"]
    t = session.drivers.t_s
    assert np.sum((t > min(2345.0, found[0].inner[0])) & (t <= max(2345.0, found[0].inner[0]))) <= 1


def test_time_constant_is_refined_beyond_its_grid(world):
    rng = np.random.default_rng(5)
    session = world.session(rng, [(world.at_joint(1, lambda d: 1.0 - np.exp(-d.t_s / 1500.0)), 3.0)])
    (found,) = search(session, rng).state.accepted
    assert found.term.physics == "link-thermal-growth"
    assert found.inner[0] == pytest.approx(1500.0, rel=0.15)


def test_swap_repairs_a_wrong_start(world):
    """The model starts with the two couplings that greedy selection takes for two effects on one lever."""
    rng = np.random.default_rng(6)
    truth = [(world.at_joint(2, sine(2)), 1.5), (world.at_joint(2, sine(3)), 1.5)]
    session = world.session(rng, truth)
    wrong = [t for t in session.candidates() if t.physics == "joint-coupling" and t.port.where == "joint2.angle"]
    bench = Bench(session)
    from calibrate.diagnose.search.line_search import refined
    from calibrate.diagnose.search.search import grown_out

    start = session.refitted([refined(bench, t, np.zeros(0)) for t in wrong[1:]])
    found = grown_out(Search(Bench(start), rng))
    assert names(found) == {
        ("joint2.angle", ("q2",), "encoder-eccentricity"),
        ("joint2.angle", ("q3",), "axis-wobble"),
    }


def test_implausible_sizes_are_not_accepted(world):
    from dataclasses import replace

    rng = np.random.default_rng(7)
    session = world.session(rng, [(world.at_joint(2, sine(2)), 1.5)])
    small = tuple(replace(t, limit=1e-6) if t.physics == "encoder-eccentricity" else t for t in session.terms)
    found = search(replace(session, terms=small), rng)
    assert "encoder-eccentricity" not in {a.term.physics for a in found.state.accepted}


def test_every_term_that_stays_is_significant(world):
    rng = np.random.default_rng(8)
    found = search(world.session(rng, [(world.at_joint(2, sine(2)), 0.5), (world.at_joint(4, sine(4)), 0.4)]), rng)
    assert len(found.state.accepted) == 2
    assert all(found.p[a.term.key] <= limits.ALPHA_FURTHER for a in found.state.accepted)


OUTSIDE = {
    "product": (("q2", "q3"), lambda d: np.tanh(d.q_rad[:, 1] * d.q_rad[:, 2])),
    "bump": (("q2",), lambda d: np.exp(-(((d.q_rad[:, 1] - 0.5) / 0.3) ** 2))),
    "beat": (("q2", "q4"), lambda d: np.sin(d.q_rad[:, 1] - 1.5 * d.q_rad[:, 3])),
}


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=() if kind == "bump" else pytest.mark.endure) for kind in OUTSIDE]
)
def test_what_no_catalogue_holds_is_unknown_at_the_right_joint(world, kind):
    drivers, function = OUTSIDE[kind]
    right = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        found = with_unknowns(search(world.session(rng, [(world.at_joint(3, function), 1.0)]), rng))
        unknown = [a.term for a in found.state.accepted if a.term.open]
        right += [(t.port.where, t.depends_on) for t in unknown] == [("joint3.angle", drivers)]
    assert right == 4


def test_a_name_that_fits_is_not_given_up_for_a_curve(world):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        found = with_unknowns(search(world.session(rng, [(world.at_joint(2, sine(2)), 3.0)]), rng))
        assert names(found) == {("joint2.angle", ("q2",), "encoder-eccentricity")}
