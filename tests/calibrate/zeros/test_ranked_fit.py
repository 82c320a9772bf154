"""Compiled loops and numpy models give the same identification."""

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.arms import compiled as ready
from calibrate.dual_psd_rig import believed_noise, dual_psd_chain
from calibrate.noisy_rows import independent
from calibrate.observations import Observations
from calibrate.problem import Problem
from calibrate.restricted_score import score_at
from calibrate.zeros import ranked_fit
from calibrate.zeros.identify import identify


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.mark.parametrize("n", [20, 90])
def test_everything_is_the_same_by_compiled_loops(rig, sessions, n, monkeypatch):
    session = sessions(3, n=n)
    data = Observations(session.q_rad, session.first_psd, session.placement, session.spots_m)
    chain, believed = dual_psd_chain(rig, data.placement, data.first_psd), believed_noise(rig)
    results = []
    for compiled in (False, True):
        monkeypatch.setattr(ready, "worth", lambda poses, compiled=compiled: compiled)
        results.append(identify(chain, data, believed, rng=np.random.default_rng(0)))
    general, fast = results
    assert fast.status is general.status
    assert fast.identifiability.rank == general.identifiability.rank
    assert [c.words for c in fast.identifiability.combinations] == [
        c.words for c in general.identifiability.combinations
    ]
    assert [e.why for e in fast.estimates] == [e.why for e in general.estimates]
    sigma = np.sqrt(np.diag(general.covariance))
    np.testing.assert_array_equal(np.diag(fast.covariance) > 0.0, sigma > 0.0)
    assert np.all(np.abs(fast.theta - general.theta) <= 1e-6 * sigma)
    np.testing.assert_allclose(np.sqrt(np.diag(fast.covariance)), sigma, rtol=1e-6)
    stated = [(a.sigma, b.sigma) for a, b in zip(fast.estimates, general.estimates, strict=True) if b.sigma]
    np.testing.assert_allclose(*np.transpose(stated), rtol=1e-5)
    assert fast.noise.joint_rad == pytest.approx(general.noise.joint_rad, rel=1e-6)
    assert fast.noise.psd_m == pytest.approx(general.noise.psd_m, rel=1e-6)
    assert fast.held_out is not None
    assert fast.held_out.rms_after_m == pytest.approx(general.held_out.rms_after_m, rel=1e-6)
    assert fast.held_out.rms_before_m == pytest.approx(general.held_out.rms_before_m, rel=1e-6)


def test_noisy_rows_by_compiled_loops_are_those_of_numpy(rig, sessions, monkeypatch):
    """In another order; what every source says of every pair of parameters is the same."""
    session = sessions(4, n=40)
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    model = believed_noise(rig).model(
        Observations(session.q_rad, session.first_psd, session.placement, session.spots_m)
    )
    problem = Problem(chain, chain.parameters, session.q_rad, session.spots_m, np.zeros((40, 4, 4)))
    theta = np.array([p.start for p in chain.parameters])
    scores = []
    information = np.full(sum(p.free for p in chain.parameters), 1e6)
    for compiled in (False, True):
        monkeypatch.setattr(ready, "worth", lambda poses, compiled=compiled: compiled)
        parts = model.parts(ranked_fit.by_joint(problem, theta))
        rows = independent(ranked_fit.noisy_rows(problem, theta, parts))
        scores.append(score_at([rows], np.array([0.3, -0.7]), information, 0.0 * information))
    np.testing.assert_allclose(scores[1].gradient, scores[0].gradient, rtol=1e-7)
    np.testing.assert_allclose(scores[1].expected, scores[0].expected, rtol=1e-7)
    np.testing.assert_allclose(scores[1].observed, scores[0].observed, rtol=1e-7)
