"""Patterns in residuals: the F test is the textbook's, finds a wave, and cries wolf as seldom as it says."""

import numpy as np
import pytest
from scipy.stats import f_oneway, kstest

from calibrate.report.evidence.session_verdict import GROUPS, pattern, patterns


def test_f_and_p_are_those_of_the_one_way_analysis_of_variance():
    rng = np.random.default_rng(1)
    values, residual = rng.uniform(-1, 1, 240), rng.normal(0.0, 2.0, (240, 1))
    found = pattern("J1", values, residual)
    groups = np.array_split(residual[np.argsort(values), 0], GROUPS)
    expected = f_oneway(*groups)
    assert (found.f, found.p) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-10)


def test_pure_noise_gives_evenly_spread_p():
    rng = np.random.default_rng(2)
    p = [pattern("J1", rng.uniform(size=150), rng.normal(size=(150, 3))).p for _ in range(300)]
    assert kstest(p, "uniform").pvalue > 1e-3


def test_a_wave_along_one_joint_is_found_there_and_nowhere_else():
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.5, 1.5, (300, 4))
    residual = rng.normal(0.0, 1.0, (300, 3))
    residual[:, 2] += 1.5 * np.sin(3.0 * q[:, 1])
    clear = [p for p in patterns(q, np.arange(300.0), residual) if p.clear]
    assert [p.factor for p in clear] == ["J2"]
    assert 0.15 < clear[0].share < 0.45  # 1.125 of 4.125 is wave; group means blur it a little


def test_a_drift_is_found_along_the_session():
    rng = np.random.default_rng(4)
    residual = rng.normal(0.0, 1.0, (200, 3)) + np.linspace(-1, 1, 200)[:, None]
    clear = [p.factor for p in patterns(rng.uniform(-1, 1, (200, 2)), np.arange(200.0), residual) if p.clear]
    assert clear == ["order in the session"]


@pytest.mark.parametrize("n", [3, 9])
def test_few_rows_have_no_pattern(n):
    assert pattern("J1", np.arange(float(n)), np.random.default_rng(0).normal(size=(n, 3))) is None


def test_a_joint_that_stands_has_no_pattern():
    assert pattern("J1", np.zeros(50), np.random.default_rng(0).normal(size=(50, 3))) is None
