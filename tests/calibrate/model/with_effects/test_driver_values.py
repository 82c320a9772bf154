"""Drivers as a diagnosis reads them off a session."""

import numpy as np
import pytest

from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.effects.curve import cause
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


def test_a_thermometer_read_now_and_then_says_what_lies_between(session):
    t_s = 10.0 * np.arange(120.0)
    slow = 22.0 + 3.0 * t_s / t_s[-1]
    found = smoothed(session, t_s, np.where(np.arange(120) % 8 == 0, slow, np.nan))
    assert np.abs(found - slow)[10:-10].max() < 0.05


def drivers_with(session, **columns):
    return fit_geometry(session_of(session.rig, changed(session.samples, **columns))).drivers


def test_a_heading_over_empty_cells_is_no_record(session):
    empty = np.full(120, np.nan)
    names = ["payload_kg", "temp_link2_degC", "psd1_sum_v", "psd2_sum_v"]
    names += [f"{stem}{i}{unit}" for stem, unit in (("cmd", "_rad"), ("qd", "_rad_s")) for i in range(1, 7)]
    found = drivers_with(session, **dict.fromkeys(names, empty))
    assert (found.payload_kg, found.cmd_minus_q_rad, found.qd_rad_s, found.psd_sum_v) == (None,) * 4
    assert "link2" not in found.temperatures_degC
    assert drivers_with(session, **{f"approach{i}": empty for i in range(1, 7)}).approach_derived


def test_a_temperature_in_another_unit_is_a_column_like_any_other(session):
    kelvin = 295.0 + np.linspace(0.0, 3.0, 120)
    found = drivers_with(session, temp_motor_K=kelvin)
    assert np.array_equal(found.extra["temp_motor_K"], kelvin)
    assert np.array_equal(cause(found, "temp_motor_K"), kelvin)


def test_the_way_a_joint_came_is_that_in_time_however_rows_are_sorted(session):
    order = np.random.default_rng(6).permutation(120)
    shuffled = session.samples.take(order)
    plain, mixed = (fit_geometry(session_of(session.rig, s)).drivers for s in (session.samples, shuffled))
    assert np.array_equal(mixed.last_move_rad, plain.last_move_rad[order])


def test_a_way_that_was_not_recorded_is_derived_in_time(session):
    order = np.random.default_rng(6).permutation(120)
    bare = changed(session.samples, **{f"approach{i}": np.full(120, np.nan) for i in range(1, 7)})
    plain, mixed = (fit_geometry(session_of(session.rig, s)).drivers for s in (bare, bare.take(order)))
    assert np.array_equal(mixed.approach, plain.approach[order])
