"""What a model leaves beside the noise that the rig file states: noise, a wrong statement, or more than noise."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import read
from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.assess.stated_noise import Statement, close_pairs, neighbours, noise_found
from calibrate.diagnose.from_recording import beyond_noise, diagnose_samples
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.effects.term import Missing
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted
from tests.calibrate.diagnose.concealed import changed

SPEED = Missing("qd", "qd1_rad_s ...", "latency")
SESSION = {"family": "tracker", "arm": "irb120", "samples": 120}
CASES = 20


def stating(folder, times=1.0, *, stated=True, **wanted):
    """A recording whose rig states the true noise over `times`, or none."""
    case = conceal(Wanted(**{**SESSION, **wanted}))
    noise = {"position_m": case.sigma_m / times} if stated else {}
    write_case(replace(case, stated=replace(case.stated, noise=noise)), folder)
    return read(folder / "recording")


def found(folder, times=1.0, *, stated=True, unnamed=False, **wanted):
    """The noise of one instrument; the rig file states the true one over `times`. The truth stays outside."""
    recording = stating(folder, times, stated=stated, **wanted)
    model = fit_geometry(session_of(recording.rig, recording.samples))
    (one,) = noise_found(model, np.random.default_rng(1), unnamed=unnamed)
    return one


def test_a_right_statement_agrees(tmp_path):
    one = found(tmp_path, seed=3)
    assert one.statement is Statement.AGREES
    assert one.says == ""
    assert one.times == pytest.approx(1.0, abs=4.0 * one.times_sigma)


def test_a_wrong_statement_is_said_with_what_supports_it(tmp_path):
    one = found(tmp_path, times=2.1, seed=3)
    assert one.statement is Statement.WRONG
    assert one.times == pytest.approx(2.1, abs=4.0 * one.times_sigma)
    assert "× the stated value" in one.says
    assert one.supports
    assert not one.opposes


def test_structure_at_another_place_is_no_wrong_statement(tmp_path):
    assert found(tmp_path, times=2.1, seed=3, unnamed=True).statement is Statement.EXCEEDED


def test_no_statement_is_no_noise(tmp_path):
    one = found(tmp_path, seed=3, stated=False)
    assert one.statement is Statement.ABSENT
    assert one.times is None


def test_a_late_clock_without_the_speed_is_more_than_noise(tmp_path):
    one = found(tmp_path, seed=8, defects=("late-clock",), enr=10.0, withhold=True)
    assert one.statement is Statement.EXCEEDED
    assert one.times > limits.MORE_THAN_STATED
    assert any("levers" in words for words in one.opposes)
    left = beyond_noise(one, (SPEED,))
    assert "× the stated noise of the positions" in left.why
    assert "missing columns that could explain it: qd1_rad_s" in left.why
    assert left.p < 0.01


def test_joints_that_come_back_a_little_off_are_named_by_what_to_state(tmp_path):
    rng, back_rad = np.random.default_rng(5), 1.5e-4
    recording = stating(tmp_path, seed=3)
    q = {f"q{j}_rad": recording.samples.column(f"q{j}_rad") + back_rad * rng.standard_normal(120) for j in range(1, 7)}
    model = fit_geometry(session_of(recording.rig, changed(recording.samples, **q)))
    (one,) = noise_found(model, rng, unnamed=False)
    assert one.statement is Statement.EXCEEDED
    (words,) = [words for words in one.opposes if "levers" in words]
    assert words.endswith("state [noise] joint_rad where the arm is known to")
    assert float(words.split("within ")[1].split(" ")[0]) == pytest.approx(1e6 * back_rad, rel=0.25)


def test_what_a_row_states_of_its_own_average_is_no_claim_about_the_reading(tmp_path):
    wanted = {"family": "dual-psd", "seed": 3, "samples": 100, "arm": None}
    case = conceal(Wanted(**{**SESSION, **wanted}))
    write_case(replace(case, stated=replace(case.stated, noise={"psd_m": case.sigma_m})), tmp_path)
    recording = read(tmp_path / "recording")
    within = {f"psd{k}_{axis}_sigma_m": np.full(100, case.sigma_m / 14.0) for k in (1, 2) for axis in "xy"}
    model = fit_geometry(session_of(recording.rig, changed(recording.samples, **within)))
    (one,) = noise_found(model, np.random.default_rng(1), unnamed=False)
    assert one.statement is Statement.AGREES
    assert one.stated == pytest.approx(case.sigma_m)


def test_without_the_needed_column_no_name_is_likely_and_the_column_comes_first(tmp_path):
    recording = stating(tmp_path, seed=8, defects=("late-clock",), enr=10.0, withhold=True, samples=80)
    diagnosis = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1)).physics.diagnosis
    assert diagnosis.verdict is not Verdict.CONSISTENT
    assert all(one.confidence <= 0.5 for one in diagnosis.findings)
    assert any("× the stated noise" in one.why for one in diagnosis.unexplained)
    assert diagnosis.next[0].startswith("record ")
    assert any("qd1_rad_s" in line for line in diagnosis.next)


def test_no_statement_is_wrong_by_a_hundred(tmp_path):
    assert found(tmp_path, times=100.0, seed=3).statement is Statement.EXCEEDED


def test_pairs_close_in_time_are_of_one_pose_and_few_samples_apart():
    repeat, sample = np.array([0, 1, 0, 1, -1, 0]), np.array([0, 1, 2, 40, 41, 42])
    np.testing.assert_array_equal(close_pairs(repeat, sample), [[0, 2]])


def test_neighbours_in_posture_are_taken_at_other_times():
    q_rad = np.repeat(np.linspace(0.0, 3.0, 12)[:, None], 2, axis=0)
    sample = np.stack([np.arange(12), 100 + np.arange(12)], axis=1).ravel()
    near = neighbours(q_rad, sample)
    np.testing.assert_array_equal(near[:, 0], np.arange(24) ^ 1)


@pytest.mark.endure
@pytest.mark.parametrize("noise", ["white", "heavy", "wandering"])
def test_a_wrong_statement_is_seldom_taken_for_physics(noise, tmp_path):
    cases = [found(tmp_path / str(i), times=2.5, seed=100 + i, noise=noise, samples=100) for i in range(CASES)]
    assert sum(one.statement is Statement.EXCEEDED for one in cases) <= 1


@pytest.mark.endure
def test_hidden_speeds_are_never_called_noise(tmp_path):
    wanted = {"defects": ("late-clock",), "enr": 4.0, "withhold": True}
    cases = [found(tmp_path / str(i), seed=100 + i, **wanted) for i in range(CASES)]
    beyond = [one for one in cases if one.times > limits.MORE_THAN_STATED]
    assert len(beyond) >= CASES // 2
    assert sum(one.statement is not Statement.EXCEEDED for one in beyond) <= 1
