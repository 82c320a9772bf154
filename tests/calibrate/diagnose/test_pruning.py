"""Terms of one port that all but cancel each other: no machine balances itself."""

import numpy as np

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.line_search import refined
from calibrate.diagnose.pruning import surrogates, tidied
from calibrate.diagnose.searching import Search
from calibrate.effects.ports import Place, Port
from calibrate.effects.term import Shape

from .conftest import Plain


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
