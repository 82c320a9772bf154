"""Chi-square: silent where noise is as stated, an alarm with its name where it is not."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.fit.accuracy.fit_statistics import (
    ALARM_P,
    Alarm,
    against_repeats,
    against_stated,
)


def test_noise_as_stated_is_no_alarm(fitted):
    fit = fitted(1).fit
    found = against_stated(fit.chi2, fit.dof)
    assert found.alarm is Alarm.NONE
    assert ALARM_P < found.p_above < 1.0 - ALARM_P
    assert found.noise_factor == pytest.approx(1.0, abs=0.25)


def test_noise_twice_the_stated_is_an_alarm_and_its_size_is_said(fitted):
    fit = fitted(1, noise=2.0).fit
    found = against_stated(fit.chi2, fit.dof)
    assert found.alarm is Alarm.ABOVE_STATED
    assert found.p_above < 1e-6
    assert 1.5 < found.noise_factor < 2.2  # drawn links and frames take up a little


def test_overstated_noise_is_an_alarm_too(fitted):
    one = fitted(1)
    timid = replace(one.problem, whitener=one.problem.whitener / 3.0)
    residual = timid.residual(one.fit.theta)
    found = against_stated(float(residual @ residual), one.fit.dof)
    assert found.alarm is Alarm.BELOW_STATED


def test_without_redundancy_nothing_is_said_about_noise(fitted):
    found = against_stated(fitted(1).fit.chi2, 0)
    assert found.alarm is Alarm.NO_REDUNDANCY
    assert np.isnan(found.p_above)
    assert np.isnan(found.noise_factor)


def repeated(rng, bias):
    """30 poses measured three times each: unit noise, and a bias of each pose that the model does not know."""
    repeat = np.repeat(np.arange(30), 3)
    return rng.normal(size=(90, 2)) + bias * rng.normal(size=(30, 2))[repeat], repeat


def as_fit(fit, residual):
    return replace(fit, chi2=float(np.sum(residual**2)), dof=residual.size)


def test_misfit_that_repeats_is_lack_of_fit_whatever_noise_was_stated(fitted):
    fit, rng = fitted(1).fit, np.random.default_rng(3)
    for stated in (0.2, 1.0, 5.0):
        honest, repeat = repeated(rng, 0.0)
        missing, _ = repeated(rng, 2.0)
        assert against_repeats(as_fit(fit, honest / stated), honest / stated, repeat).alarm is Alarm.NONE
        found = against_repeats(as_fit(fit, missing / stated), missing / stated, repeat)
        assert found.alarm is Alarm.LACK_OF_FIT
        assert found.chi2_per_dof == pytest.approx(1.0 / stated**2, rel=0.3)
        assert (found.groups, found.dof) == (30, 120)


def test_rows_that_do_not_repeat_give_no_answer(fitted):
    residual, _ = repeated(np.random.default_rng(4), 0.0)
    fit = as_fit(fitted(1).fit, residual)
    assert against_repeats(fit, residual, np.full(90, -1)) is None
    assert against_repeats(fit, residual, np.arange(90)) is None
