"""Terms of one port that all but cancel each other: no machine balances itself."""

import numpy as np

from calibrate.diagnose.search import pruning
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.search.pruning import (
    balances,
    confirmed,
    surrogates,
    tidied,
)
from calibrate.diagnose.search.searching import Search, null_at
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Shape
from tests.calibrate.diagnose.conftest import Plain


def two_columns(world, rng, apart, amount):
    """Two columns that differ little, at one joint, and a reading that follows their difference."""
    fan = rng.normal(size=200)
    extra = {"fan": fan, "hum": fan + apart * rng.normal(size=200)}
    session = world.session(rng, extra=extra)
    moved = session.lever[:, :, 1] * (amount * (extra["hum"] - extra["fan"]))[:, None]
    session = world.with_readings(session, session.readings + moved)
    port = Port("joint2.angle", Place.JOINTS)
    terms = [Plain(port, (name,), Shape.LINEAR, f"by-{name}", joint=1) for name in extra]
    return Bench(session.refitted([refined(Bench(session), term, np.zeros(0)) for term in terms]))


def test_of_two_terms_that_balance_each_other_one_goes(world):
    rng = np.random.default_rng(0)
    bench = two_columns(world, rng, apart=0.05, amount=20.0)
    a, b = (x.coefficients[0] for x in bench.state.accepted)
    assert a * b < 0.0
    (worst,) = surrogates(bench)
    assert worst == int(np.argmin([gone.squares for gone in bench.gone]))
    assert len(tidied(Search(bench, rng)).state.accepted) < 2


def test_two_terms_of_one_port_that_both_act_stay(world):
    rng = np.random.default_rng(1)
    bench = two_columns(world, rng, apart=1.5, amount=2.0)
    assert surrogates(bench) == []
    assert len(tidied(Search(bench, rng)).state.accepted) == 2


def test_an_exchange_that_balances_a_port_is_seen(world):
    """Pruning would take one of the two away again, round after round."""
    rng = np.random.default_rng(0)
    both = two_columns(world, rng, apart=0.05, amount=20.0)
    one = Bench(both.state.refitted(both.state.accepted[:1]))
    assert balances(both, one)
    assert not balances(one, both)
    assert not balances(both, both)


def test_what_goes_is_not_taken_for_noise_that_the_others_are_judged_by(world, monkeypatch):
    rng = np.random.default_rng(3)
    wave = world.session(rng, [(world.at_joint(2, lambda d: np.sin(d.q_rad[:, 1])), 2.0)])
    names = {"encoder-eccentricity": "joint2.angle", "joint-coupling": "joint4.angle", "backlash": "joint1.angle"}
    terms = [next(t for t in wave.candidates() if (t.physics, t.port.where) == item) for item in names.items()]
    at = Search(Bench(wave.refitted([refined(Bench(wave), t, np.zeros(0)) for t in terms])), rng)
    drawn = []
    monkeypatch.setattr(pruning, "null_at", lambda *given: drawn.append(given) or null_at(*given))
    assert [a.term.physics for a in confirmed(at).state.accepted] == ["encoder-eccentricity"]
    assert len(drawn) == 1
