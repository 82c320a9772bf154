"""Drivers as a diagnosis reads them off a session."""

import numpy as np
import pytest

from calibrate.diagnose.fitted import fit_geometry
from calibrate.diagnose.session import session_of
from tests.calibrate.diagnose.concealed import changed, recording_of


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return recording_of(tmp_path_factory.mktemp("warm"), family="tracker", seed=3, defects=(), samples=120)


def smoothed(session, t_s, T_degC):
    samples = changed(session.samples, t_s=t_s, temp_link2_degC=T_degC)
    return fit_geometry(session_of(session.rig, samples)).drivers.temperatures_degC["link2"]


def test_a_noisy_thermometer_is_smoothed_along_the_session(session):
    t_s = 10.0 * np.arange(120.0)
    slow = 22.0 + 3.0 * t_s / t_s[-1]
    noise = np.random.default_rng(0).normal(0.0, 0.1, 120)
    found = smoothed(session, t_s, slow + noise)
    assert np.std(found - slow) < 0.5 * np.std(noise)


def test_what_warmed_during_a_pause_is_not_smoothed_over_it(session):
    t_s = 10.0 * np.arange(120.0) + np.where(np.arange(120) >= 60, 3000.0, 0.0)
    T_degC = np.where(np.arange(120) >= 60, 27.0, 22.0)
    assert np.allclose(smoothed(session, t_s, T_degC), T_degC)
