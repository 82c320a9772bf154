"""A model says how its fit was made and which rule ended it; the limits of Dog-Leg come from the plan."""

import json

import msgspec
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from calibrate.fit.accuracy import minus_2_log_likelihood
from calibrate.fit.fit_plan import parse_plan
from calibrate.fit.identify.identify import identify, without_gross_errors
from calibrate.fit.identify.record import record_of
from calibrate.fit.identify.rounds import settled_fit
from calibrate.fit.solvers import Status, Stop
from calibrate.model.model_file import RigIdentity, read_model, write_model
from tests.calibrate.fit.identify.conftest import table

NOISE_M = 1e-5
HEAD = 'schema = 1\nshare = 0\nsolver = "dog-leg"\n[dog-leg]\n'
OFF = "e1 = 0\ne2 = 0\ne3 = 0\n"  # one rule at a time


@pytest.fixture
def tracked(rig, session):
    rig = msgspec.structs.replace(rig, noise=msgspec.structs.replace(rig.noise, position_m=NOISE_M))
    q = session.readings(80)
    return rig, table(q, **session.positions(q, NOISE_M))


def run(tracked, text):
    return identify(*tracked, rng=np.random.default_rng(0), plan=parse_plan(text, "fit.toml"))


@pytest.mark.parametrize(
    ("limits", "ended_by"),
    [
        (OFF.replace("e1 = 0", "e1 = 1e9"), Stop.GRADIENT),
        (OFF.replace("e2 = 0", "e2 = 1e-3"), Stop.STEP),
        (OFF.replace("e2 = 0", "e2 = 0.1") + "delta0 = 1e-3", Stop.RADIUS),
        (OFF.replace("e3 = 0", "e3 = 1e9"), Stop.RESIDUAL),
        (OFF + "kmax = 2", Stop.STEPS),
    ],
)
def test_each_rule_ends_a_fit_when_the_plan_sets_its_limit(tracked, limits, ended_by):
    result = run(tracked, HEAD + limits)
    assert result.end.stop is ended_by
    record = record_of(result, RigIdentity("any", "sha"), "dh").fit
    assert (record.method, record.ended_by, record.says) == ("dog-leg", ended_by.name, ended_by.value)


def test_few_iterations_are_no_answer_and_counted(tracked):
    result = run(tracked, HEAD + OFF + "kmax = 1\ndelta0 = 1e-3")
    assert result.status is Status.OUT_OF_STEPS
    assert 1 <= result.end.iterations <= 6  # one a round


def test_the_usual_numbers_give_the_usual_answer(tracked):
    usual = run(tracked, 'schema = 1\nshare = 0\nsolver = "dog-leg"\n')
    stated = run(tracked, HEAD)
    np.testing.assert_array_equal(usual.theta, stated.theta)
    assert usual.end == stated.end


def test_the_model_file_holds_the_end_of_the_fit_and_older_ones_are_read(tracked, tmp_path):
    result = run(tracked, "schema = 1\nshare = 0\n")
    model = record_of(result, RigIdentity("any", "sha"), "dh")
    path = tmp_path / "model.json"
    write_model(path, model)
    assert read_model(path).fit == model.fit
    content = json.loads(path.read_text())
    assert content["fit"]["method"] == "levenberg-marquardt"
    assert content["fit"]["loss"] == "least-squares"
    assert content["fit"].pop("law") == "normal"
    path.write_text(json.dumps(content))
    assert read_model(path).fit == msgspec.structs.replace(model.fit, law=None)  # an earlier version
    assert content["fit"]["iterations"] == result.end.iterations > 0
    assert content["fit"]["ended_by"] in {stop.name for stop in Stop}
    del content["fit"]
    path.write_text(json.dumps(content))
    assert read_model(path).fit is None


@pytest.mark.parametrize("instrument", ["position", "distance"])
def test_the_likelihood_is_that_of_the_normal_law(tracked, instrument):
    """By the covariance of all rows at once, neighbouring distances correlated."""
    plan = parse_plan(f'schema = 1\ninstruments = ["{instrument}"]\n', "fit.toml")
    weighting, start, _ = without_gross_errors(*tracked, plan)
    fitted = settled_fit(weighting, start)
    (block,) = fitted.problem.blocks
    misfit = block.misfit(fitted.fit.theta).ravel()
    n, k = block.rows, block.observed.shape[1]
    whitener = np.zeros((n * k, n * k))
    for i, own in enumerate(block.whitener):
        whitener[i * k : i * k + k, i * k : i * k + k] = own
    shared = np.eye(n * k)
    if block.correlation is not None:
        shared += np.diag(block.correlation[:-1], 1) + np.diag(block.correlation[:-1], -1)
    inverse = np.linalg.inv(whitener)
    law = multivariate_normal(cov=inverse @ shared @ inverse.T, allow_singular=True)
    expected = -2.0 * law.logpdf(misfit)
    assert minus_2_log_likelihood(fitted.problem, fitted.fit.theta) == pytest.approx(expected, rel=1e-6)
