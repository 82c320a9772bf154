"""Laws of an error: moments, what is drawn of them, and what is refused."""

import numpy as np
import pytest
from scipy import stats

from calibrate.error_simulation.sources import Law
from calibrate.errors import DataError

LAWS = [
    Law("normal", 2.0, 1.0),
    Law("uniform", 2.0, 1.0),
    Law("constant", 2.0, 1.0),
    Law("rayleigh", 2.0),
    Law("laplace", 0.5, -1.0),
    Law("triang", 3.0, 0.0, (0.2,)),
    Law("t", 1.0, 0.0, (6.0,)),
    Law("weibull_min", 1.0, 0.0, (1.5,)),
]


def drawn(law):
    return law.draw(np.random.default_rng(3), 102_400)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_what_is_drawn_has_the_moments_of_the_law(law):
    x = drawn(law)
    sigma = np.sqrt(law.variance)
    assert abs(x.mean() - law.mean) < 5.0 * sigma / np.sqrt(len(x)) + 1e-12
    assert x.std() == pytest.approx(sigma, rel=0.02, abs=1e-12)


@pytest.mark.parametrize("law", [law for law in LAWS if law.name != "constant"], ids=lambda law: law.name)
def test_what_is_drawn_follows_the_law(law):
    shares = np.linspace(0.01, 0.99, 99)
    below = np.searchsorted(np.sort(drawn(law)), law.quantiles(shares)) / 102_400
    assert np.max(np.abs(below - shares)) < 0.008


def test_tails_of_a_table_are_the_laws_own():
    table = Law("norm", 1.0).table
    assert table[1, 1] == pytest.approx(stats.norm.ppf(1.0 / 1024**2))
    assert table[2, -2] == pytest.approx(-stats.norm.ppf(1.0 / 1024**2), rel=1e-6)


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (("cauchy", 1.0), "no variance"),
        (("gauss", 1.0), "no continuous law"),
        (("unifrom", 1.0), "did you mean 'uniform'"),
        (("normal", -1.0), "not negative"),
        (("triang", 1.0), "give its shape"),
        (("normal", 1.0, 0.0, (1.0,)), "has no shape"),
    ],
)
def test_what_is_no_law_of_an_error_is_refused(law, says):
    with pytest.raises(DataError, match=says):
        Law(*law)
